// `pvsfarm-worker`: one single-threaded evaluator, any number of them, any time, anywhere.
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "common/base/log.hpp"
#include "worker/evaluator/evaluator.hpp"
#include "worker/inquiry/audit.hpp"
#include "worker/inquiry/explain.hpp"
#include "worker/render/osmesa_context.hpp"
#include "worker/service/manners.hpp"
#include "worker/service/scene_cache.hpp"
#include "worker/service/worker.hpp"

namespace pvsfarm {
namespace {

using Scenery = Workshop::Scenery;

EvaluateCell make_evaluator(Scenery scene, const EvaluatorSettings& settings) {
  const auto evaluator = std::make_shared<Evaluator>(std::move(scene), settings, thread_cpu_ms);
  return [evaluator](const CellKey& key, const Cell& cell, const VisibleSet& parent) {
    return evaluator->evaluate(key, cell, parent);
  };
}

AnswerAudit make_auditor(Scenery scene, const EvaluatorSettings& settings) {
  const auto auditor = std::make_shared<Auditor>(std::move(scene), settings.near_m);
  return [auditor](const AuditQuestion& question) { return auditor->audit(question); };
}

AnswerExplain make_explainer(Scenery scene, const EvaluatorSettings& settings) {
  const auto explainer = std::make_shared<Explainer>(std::move(scene), settings);
  return [explainer](const ExplainQuestion& question) { return explainer->explain(question); };
}

Status read_keys(const std::string& key, const std::string& server_key, WorkerOptions& options) {
  if (key.empty() != server_key.empty())
    return Error{ErrorKind::kCommandLine, "--key and --server-key go together"};
  if (key.empty()) return {};
  const Result<KeyPair> own = read_key_file(key);
  if (!own) return own.error();
  const Result<KeyBytes> server = read_public_key(server_key);
  if (!server) return server.error();
  options.security = ClientSecurity{*own, *server};
  return {};
}

struct Manners {
  bool low_priority = false;
  std::uint64_t memory_mib = 0;  // 0: no limit
  std::string log_format = "text";
};

void add_manners(CLI::App& app, Manners& manners) {
  app.add_flag("--low-priority", manners.low_priority,
               "use processor and disk only when nobody else wants them");
  app.add_option("--memory-limit", manners.memory_mib,
                 "MiB the worker may have beside the mapped scene; a task that needs more fails, "
                 "and goes to another worker")
      ->check(CLI::Range(64, 1 << 24));
  app.add_option("--log-format", manners.log_format, "of the lines on stderr: text or json")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
}

void mind(const Manners& manners) {
  std::string note;
  if (manners.low_priority) step_back(note);
  if (!note.empty()) log_info(note);
  if (manners.memory_mib == 0) return;
  if (const Status limited = limit_memory(manners.memory_mib << 20); !limited)
    log_warning(limited.error().text);
}

int run(int argc, char** argv) {
  WorkerOptions options{.cache_folder = default_cache_folder(),
                        .build = "pvsfarm-worker " PVSFARM_VERSION};
  int verbosity = 0;
  bool quiet = false;
  Manners manners;
  CLI::App app("Evaluates cells for a pvsfarm coordinator.", "pvsfarm-worker");
  app.add_option("--connect", options.endpoint, "where the coordinator listens")
      ->required()
      ->envname("PVSFARM_CONNECT");
  app.add_option("--cache", options.cache_folder, "folder for scenes that are fetched")
      ->envname("PVSFARM_CACHE")
      ->capture_default_str();
  std::string key, server_key;
  app.add_option("--key", key, "FILE of pvsfarm keygen: this worker's private key")
      ->envname("PVSFARM_KEY");
  app.add_option("--server-key", server_key,
                 "the coordinator's public key, or a FILE that holds it")
      ->envname("PVSFARM_SERVER_KEY");
  app.add_option("--max-idle", options.max_idle_s, "leave after so many seconds without work")
      ->check(CLI::NonNegativeNumber);
  add_manners(app, manners);
  app.add_flag("-q,--quiet", quiet, "only warnings and errors");
  app.add_flag("-v,--verbose", verbosity, "more on stderr");
  app.set_version_flag("--version", "pvsfarm-worker " PVSFARM_VERSION);
  app.footer(
      "SIGTERM: finishes its task and leaves. Exit codes: 0 done, 42 do not start it again,\n"
      "75 start it again.\n"
      "Example:\n  pvsfarm-worker --connect tcp://127.0.0.1:5555");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::cerr << "pvsfarm-worker: " << error.what() << "; see pvsfarm-worker --help\n";
    return kExitDoNotRetry;
  }
  const LogLevel usual = quiet ? LogLevel::kWarning : LogLevel::kInfo;
  set_up_log({.program = "pvsfarm-worker",
              .level = verbosity > 0 ? LogLevel::kDebug : usual,
              .json = manners.log_format == "json"});
  mind(manners);
  if (const Status status = read_keys(key, server_key, options); !status) {
    log_error(status.error().text);
    return kExitDoNotRetry;
  }
  options.kernel.mesa_version = OsmesaContext::mesa_version();
  return run_worker(options, {.make_evaluator = make_evaluator,
                              .make_auditor = make_auditor,
                              .make_explainer = make_explainer,
                              .begin_thread = manners.low_priority ? run_when_idle : nullptr,
                              .has_osmesa = !options.kernel.mesa_version.empty()});
}

}  // namespace
}  // namespace pvsfarm

int main(int argc, char** argv) {
  try {
    return pvsfarm::run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "pvsfarm-worker: " << error.what() << '\n';
    return pvsfarm::kExitRetry;
  }
}

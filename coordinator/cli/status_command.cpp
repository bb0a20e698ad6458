// `pvsfarm status OUT.pvs|ENDPOINT`: how far a running bake is.
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "coordinator/cli/ask_coordinator.hpp"
#include "coordinator/cli/command.hpp"
#include "coordinator/cli/progress_line.hpp"
#include "coordinator/cli/text.hpp"

namespace pvsfarm {
namespace {

struct StatusOptions {
  CoordinatorAddress address;
  bool json = false;
};

// File names need not be UTF-8; JSON must be.
std::string dump(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void print_json(const StatusReport& r) {
  nlohmann::ordered_json workers = nlohmann::ordered_json::array();
  for (const StatusReport::Worker& w : r.workers)
    workers.push_back({{"host", w.host},
                       {"pid", w.pid},
                       {"cells_done", w.cells_done},
                       {"leases", w.leases},
                       {"silent_ms", w.silent_ms},
                       {"resident_bytes", w.resident_bytes}});
  nlohmann::ordered_json json{{"output", r.output},
                              {"state", r.state},
                              {"cells_done", r.cells_done},
                              {"cells_open", r.cells_open},
                              {"cells_expected", r.cells_expected},
                              {"cells_per_second", r.cells_per_second},
                              {"eta_s", nullptr},
                              {"result_bytes", r.result_bytes},
                              {"elapsed_ms", r.elapsed_ms},
                              {"last_error", r.last_error},
                              {"workers", workers}};
  if (r.eta_s >= 0) json["eta_s"] = r.eta_s;
  std::cout << dump(json) << '\n';
}

void print_text(const StatusReport& r) {
  std::cout << r.output << ": " << r.state << ", " << progress_text(r) << ", "
            << duration_text(static_cast<double>(r.elapsed_ms) / 1e3) << " so far\n"
            << r.cells_open << " cells open\n";
  for (const StatusReport::Worker& w : r.workers)
    std::cout << "worker " << w.host << ':' << w.pid << ": " << w.cells_done << " cells, "
              << w.leases << " leases, heard " << w.silent_ms << " ms ago, "
              << bytes_text(w.resident_bytes) << '\n';
  if (!r.last_error.empty()) std::cout << "last trouble: " << r.last_error << '\n';
}

}  // namespace

void add_status_command(CLI::App& app, CommandContext& context) {
  auto options = std::make_shared<StatusOptions>();
  CLI::App* command = app.add_subcommand("status", "how far a running bake is");
  add_coordinator_address(*command, options->address);
  command->add_flag("--json", options->json, "as one JSON object");
  command->footer(
      "Examples:\n  pvsfarm status city.pvs\n  pvsfarm status --connect tcp://host:5555 "
      "--key admin.key --server-key farm.pub");
  command->callback([&context, options] {
    context.run = [options]() -> Status {
      const Result<Message> answer = ask_coordinator(options->address, StatusGet{});
      if (!answer) return answer.error();
      const auto* report = std::get_if<StatusReport>(&*answer);
      if (report == nullptr)
        return runtime_error(options->address.name() + ": not a status in answer");
      options->json ? print_json(*report) : print_text(*report);
      return {};
    };
  });
}

}  // namespace pvsfarm

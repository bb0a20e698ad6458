// `pvsfarm bake SCENE -o OUT.pvs`: coordinator and workers on this machine.
#include <CLI/CLI.hpp>
#include <charconv>
#include <filesystem>

#include "coordinator/cli/bake_options.hpp"
#include "coordinator/cli/command.hpp"

namespace pvsfarm {

namespace {

constexpr unsigned kMaxWorkers = 256;

struct LocalOptions {
  std::string workers = "2";
  bool low_priority = false;
  std::uint64_t memory_mib = 0;  // a worker; 0: no limit
};

// "auto" or a number; 0 for neither.
unsigned workers_in(const std::string& text) {
  if (text == "auto") return std::min(usable_processors(), kMaxWorkers);
  unsigned count = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  return error == std::errc{} && end == text.data() + text.size() && count <= kMaxWorkers ? count
                                                                                          : 0;
}

void add_local_options(CLI::App& command, LocalOptions& options) {
  command.add_option("--workers", options.workers, "worker processes; auto: one a processor")
      ->check(CLI::Validator(
          [](const std::string& text) {
            return workers_in(text) > 0 ? std::string()
                                        : "\"" + text + "\" is neither auto nor 1 to 256";
          },
          "N|auto"))
      ->capture_default_str();
  command.add_flag("--low-priority", options.low_priority,
                   "workers use processor and disk only when nobody else wants them");
  command
      .add_option("--memory-limit", options.memory_mib,
                  "MiB a worker may have beside the scene; cells that need more keep their "
                  "parent's set")
      ->check(CLI::Range(64, 1 << 24));
}

FarmOptions farm_options(const LocalOptions& options, const CommandContext& context) {
  const auto beside = std::filesystem::path(context.program).parent_path() / "pvsfarm-worker";
  FarmOptions farm{.local_workers = workers_in(options.workers), .worker_program = beside.string()};
  farm.worker_arguments = {context.verbosity > 0 ? "--verbose" : "--quiet"};
  if (context.json_log) farm.worker_arguments.push_back("--log-format=json");
  if (options.low_priority) farm.worker_arguments.push_back("--low-priority");
  if (options.memory_mib > 0)
    farm.worker_arguments.push_back("--memory-limit=" + std::to_string(options.memory_mib));
  farm.own_sessions = options.low_priority;
  return farm;
}

}  // namespace

void add_bake_command(CLI::App& app, CommandContext& context) {
  CLI::App* command =
      app.add_subcommand("bake", "compute the visible sets of a scene on this machine");
  const std::shared_ptr<BakeOptions> options = add_bake_options(*command);
  auto local = std::make_shared<LocalOptions>();
  add_local_options(*command, *local);
  command->footer(
      "Ctrl-C keeps what is done; the same command goes on from there.\n"
      "Examples:\n"
      "  pvsfarm bake city.glb -o city.pvs\n"
      "  pvsfarm bake city.obj --cells city.cells.json --budget 20000 -o city.pvs\n"
      "  pvsfarm bake rooms.obj --cells grid:2 --workers 8 --json -o rooms.pvs");
  command->callback([&context, options, local] {
    context.run = [&context, options, local] {
      return run_bake(*options, farm_options(*local, context), context);
    };
  });
}

}  // namespace pvsfarm

// `pvsfarm bake SCENE -o OUT.pvs`: coordinator and workers on this machine.
#include <CLI/CLI.hpp>
#include <filesystem>

#include "coordinator/cli/bake_options.hpp"
#include "coordinator/cli/command.hpp"

namespace pvsfarm {

void add_bake_command(CLI::App& app, CommandContext& context) {
  CLI::App* command =
      app.add_subcommand("bake", "compute the visible sets of a scene on this machine");
  const std::shared_ptr<BakeOptions> options = add_bake_options(*command);
  auto workers = std::make_shared<unsigned>(2);
  command->add_option("--workers", *workers, "worker processes")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  command->footer(
      "Ctrl-C keeps what is done; the same command goes on from there.\n"
      "Examples:\n"
      "  pvsfarm bake city.glb -o city.pvs\n"
      "  pvsfarm bake city.obj --cells city.cells.json --budget 20000 -o city.pvs\n"
      "  pvsfarm bake rooms.obj --cells grid:2 --workers 8 --json -o rooms.pvs");
  command->callback([&context, options, workers] {
    context.run = [&context, options, workers] {
      const auto beside = std::filesystem::path(context.program).parent_path() / "pvsfarm-worker";
      FarmOptions farm{.local_workers = *workers, .worker_program = beside.string()};
      farm.worker_arguments = {context.verbosity > 0 ? "--verbose" : "--quiet"};
      return run_bake(*options, farm, context);
    };
  });
}

}  // namespace pvsfarm

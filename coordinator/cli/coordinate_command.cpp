// `pvsfarm coordinate SCENE -o OUT.pvs --bind ENDPOINT`: a bake whose workers come by themselves.
#include <CLI/CLI.hpp>

#include "coordinator/cli/bake_options.hpp"
#include "coordinator/cli/command.hpp"
#include "coordinator/cli/endpoint.hpp"

namespace pvsfarm {
void add_coordinate_command(CLI::App& app, CommandContext& context) {
  CLI::App* command =
      app.add_subcommand("coordinate", "the same for workers that connect by themselves");
  const std::shared_ptr<BakeOptions> options = add_bake_options(*command);
  auto endpoint = std::make_shared<std::string>();
  command->add_option("--bind", *endpoint, "where to listen: tcp://127.0.0.1:PORT or ipc:///PATH")
      ->required();
  command->footer(
      "Examples:\n"
      "  pvsfarm coordinate city.glb -o city.pvs --bind tcp://127.0.0.1:5555\n"
      "  pvsfarm-worker --connect tcp://127.0.0.1:5555");
  command->callback([&context, options, endpoint] {
    context.run = [&context, options, endpoint]() -> Status {
      if (Status status = check_endpoint(*endpoint); !status) return status;
      return run_bake(*options, {.endpoint = *endpoint, .local_workers = 0}, context);
    };
  });
}

}  // namespace pvsfarm

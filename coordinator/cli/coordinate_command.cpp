// `pvsfarm coordinate SCENE -o OUT.pvs --bind ENDPOINT`: a bake whose workers come by themselves.
#include <CLI/CLI.hpp>

#include "coordinator/cli/bake_options.hpp"
#include "coordinator/cli/command.hpp"
#include "coordinator/cli/door.hpp"

namespace pvsfarm {
void add_coordinate_command(CLI::App& app, CommandContext& context) {
  CLI::App* command =
      app.add_subcommand("coordinate", "the same for workers that connect by themselves");
  const std::shared_ptr<BakeOptions> options = add_bake_options(*command);
  auto door = std::make_shared<Door>();
  add_door_options(*command, *door)->required();
  command->footer(
      "Examples:\n"
      "  pvsfarm coordinate city.glb -o city.pvs --bind tcp://127.0.0.1:5555\n"
      "  pvsfarm-worker --connect tcp://127.0.0.1:5555\n"
      "For workers of other machines, which need keys: pvsfarm keygen --help");
  command->callback([&context, options, door] {
    context.run = [&context, options, door]() -> Status {
      Result<std::optional<FarmKeys>> keys = keys_of(*door);
      if (!keys) return keys.error();
      return run_bake(*options,
                      {.endpoint = door->endpoint, .local_workers = 0, .keys = *std::move(keys)},
                      context);
    };
  });
}

}  // namespace pvsfarm

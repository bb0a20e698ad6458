// `pvsfarm coordinate SCENE -o OUT.pvs --bind ENDPOINT`: a bake whose workers come by themselves.
#include <CLI/CLI.hpp>

#include "coordinator/cli/bake_options.hpp"
#include "coordinator/cli/command.hpp"

namespace pvsfarm {
namespace {

bool stays_on_this_machine(const std::string& endpoint) {
  for (const char* start : {"ipc://", "tcp://127.", "tcp://localhost:", "tcp://[::1]:"})
    if (endpoint.rfind(start, 0) == 0) return true;
  return false;
}

}  // namespace

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
      if (!stays_on_this_machine(*endpoint))
        return Error{ErrorKind::kUnsupported,
                     *endpoint +
                         ": workers are not authenticated yet, so only ipc:// and loopback "
                         "addresses are listened on; reach them from elsewhere through a "
                         "tunnel (ssh -R)"};
      return run_bake(*options, {.endpoint = *endpoint, .local_workers = 0}, context);
    };
  });
}

}  // namespace pvsfarm

#include <CLI/CLI.hpp>
#include <memory>

#include "coordinator/cli/command.hpp"

namespace pvsfarm {

void add_inspect_command(CLI::App& app, CommandContext& context) {
  auto path = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("inspect", "what a store holds, in a page");
  command->add_option("store", *path, "the .pvs file")->required();
  command->footer("Examples:\n  pvsfarm inspect city.pvs");
  command->callback([&context, path] {
    context.run = [path]() -> Status { return Error{ErrorKind::kUnsupported, "not yet"}; };
  });
}

}  // namespace pvsfarm

// `pvsfarm cancel OUT.pvs|ENDPOINT`: stop a running bake at once.
#include <CLI/CLI.hpp>
#include <memory>

#include "coordinator/cli/ask_coordinator.hpp"
#include "coordinator/cli/command.hpp"

namespace pvsfarm {

void add_cancel_command(CLI::App& app, CommandContext& context) {
  auto address = std::make_shared<CoordinatorAddress>();
  CLI::App* command = app.add_subcommand("cancel", "stop a running bake at once");
  add_coordinator_address(*command, *address);
  command->footer(
      "Only what is in the journal stays: the bake command goes on from there.\n"
      "Example:\n  pvsfarm cancel city.pvs");
  command->callback([&context, address] {
    context.run = [address]() -> Status {
      const Result<Message> answer = ask_coordinator(*address, Control{ControlKind::kCancel});
      if (!answer) return answer.error();
      return {};
    };
  });
}

}  // namespace pvsfarm

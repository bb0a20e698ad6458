// `pvsfarm drain OUT.pvs|ENDPOINT`: let a running bake finish its tasks and stop.
#include <CLI/CLI.hpp>
#include <memory>

#include "coordinator/cli/ask_coordinator.hpp"
#include "coordinator/cli/command.hpp"

namespace pvsfarm {

void add_drain_command(CLI::App& app, CommandContext& context) {
  auto address = std::make_shared<CoordinatorAddress>();
  CLI::App* command = app.add_subcommand("drain", "let a running bake finish its tasks and stop");
  add_coordinator_address(*command, *address);
  command->footer(
      "What runs is finished, nothing new is begun, the journal stays: the bake command goes on "
      "from there.\n"
      "Example:\n  pvsfarm drain city.pvs");
  command->callback([&context, address] {
    context.run = [address]() -> Status {
      const Result<Message> answer = ask_coordinator(*address, Control{ControlKind::kDrain});
      if (!answer) return answer.error();
      return {};
    };
  });
}

}  // namespace pvsfarm

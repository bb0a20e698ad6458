// `pvsfarm pause OUT.pvs|ENDPOINT`: hand out nothing new for a while.
#include <CLI/CLI.hpp>
#include <memory>

#include "coordinator/cli/ask_coordinator.hpp"
#include "coordinator/cli/command.hpp"

namespace pvsfarm {

void add_pause_command(CLI::App& app, CommandContext& context) {
  auto address = std::make_shared<CoordinatorAddress>();
  CLI::App* command = app.add_subcommand("pause", "hand out nothing new until resume");
  add_coordinator_address(*command, *address);
  command->footer(
      "What runs is finished; workers stay connected and idle, except those with --max-idle.\n"
      "Example:\n  pvsfarm pause city.pvs");
  command->callback([&context, address] {
    context.run = [address]() -> Status {
      const Result<Message> answer = ask_coordinator(*address, Control{ControlKind::kPause});
      if (!answer) return answer.error();
      return {};
    };
  });
}

}  // namespace pvsfarm

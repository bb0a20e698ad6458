// `pvsfarm resume OUT.pvs|ENDPOINT`: go on after `pause`.
#include <CLI/CLI.hpp>
#include <memory>

#include "coordinator/cli/ask_coordinator.hpp"
#include "coordinator/cli/command.hpp"

namespace pvsfarm {

void add_resume_command(CLI::App& app, CommandContext& context) {
  auto address = std::make_shared<CoordinatorAddress>();
  CLI::App* command = app.add_subcommand("resume", "go on after pause");
  add_coordinator_address(*command, *address);
  command->footer("Example:\n  pvsfarm resume city.pvs");
  command->callback([&context, address] {
    context.run = [address]() -> Status {
      const Result<Message> answer = ask_coordinator(*address, Control{ControlKind::kResume});
      if (!answer) return answer.error();
      return {};
    };
  });
}

}  // namespace pvsfarm

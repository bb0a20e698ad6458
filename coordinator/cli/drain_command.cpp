// `pvsfarm drain OUT.pvs|ENDPOINT`: let a running bake finish its tasks and stop.
#include <CLI/CLI.hpp>
#include <memory>

#include "coordinator/cli/ask_coordinator.hpp"
#include "coordinator/cli/command.hpp"

namespace pvsfarm {

void add_drain_command(CLI::App& app, CommandContext& context) {
  auto where = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("drain", "let a running bake finish its tasks and stop");
  command->add_option("where", *where, "the bake's OUT.pvs, or its endpoint")->required();
  command->footer(
      "What runs is finished, nothing new is begun, the journal stays: the bake command goes on "
      "from there.\n"
      "Example:\n  pvsfarm drain city.pvs");
  command->callback([&context, where] {
    context.run = [where]() -> Status {
      const Result<Message> answer = ask_coordinator(*where, Control{ControlKind::kDrain});
      if (!answer) return answer.error();
      return {};
    };
  });
}

}  // namespace pvsfarm

// The commands of `pvsfarm`: one file each, added to the parser by one function.
//
// A command's function declares its subcommand, options and examples, and has the parser's callback
// store what to do in `CommandContext::run`. Nothing runs before the whole command line is read.
//
//   void add_inspect_command(CLI::App& app, CommandContext& context) {
//     auto options = std::make_shared<InspectOptions>();
//     CLI::App* command = app.add_subcommand("inspect", "What a store holds");
//     command->add_option("store", options->path, "the .pvs file")->required();
//     command->footer("Examples:\n  pvsfarm inspect city.pvs");
//     command->callback([&context, options] { context.run = [options] { return inspect(*options);
//     }; });
//   }
//
// Every long option also has an environment variable, PVSFARM_ and its name in capitals
// (--min-cell: PVSFARM_MIN_CELL), and a key in the file of --config, under [the command].
// Flag > environment > file > default.
#pragma once

#include <functional>
#include <string>

#include "common/base/result.hpp"

namespace CLI {
class App;
}

namespace pvsfarm {

struct CommandContext {
  int verbosity = 0;      // -q: -1; -v: 1; -vv: 2
  bool json_log = false;  // --log-format json
  bool color = false;     // stderr is a terminal and NO_COLOR is unset
  std::string program;    // path of this executable: pvsfarm-worker stands beside it
  // What the chosen command does. Data goes to stdout, everything else to stderr. An Error ends the
  // program with its kind as the exit code and its text as the one line `pvsfarm: text`.
  std::function<Status()> run;
};

void add_audit_command(CLI::App& app, CommandContext& context);
void add_bake_command(CLI::App& app, CommandContext& context);
void add_cancel_command(CLI::App& app, CommandContext& context);
void add_chart_command(CLI::App& app, CommandContext& context);
void add_coordinate_command(CLI::App& app, CommandContext& context);
void add_diff_command(CLI::App& app, CommandContext& context);
void add_drain_command(CLI::App& app, CommandContext& context);
void add_explain_command(CLI::App& app, CommandContext& context);
void add_export_command(CLI::App& app, CommandContext& context);
void add_generate_command(CLI::App& app, CommandContext& context);
void add_inspect_command(CLI::App& app, CommandContext& context);
void add_keygen_command(CLI::App& app, CommandContext& context);
void add_pause_command(CLI::App& app, CommandContext& context);
void add_query_command(CLI::App& app, CommandContext& context);
void add_resume_command(CLI::App& app, CommandContext& context);
void add_status_command(CLI::App& app, CommandContext& context);
void add_validate_command(CLI::App& app, CommandContext& context);

}  // namespace pvsfarm

// `pvsfarm`: reads the command line, sets up the log, runs one command, reports how it ended.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <system_error>

#include "common/base/log.hpp"
#include "coordinator/cli/command.hpp"
#include "coordinator/cli/settings_sources.hpp"

namespace pvsfarm {
namespace {

constexpr const char* kDescription =
    "pvsfarm computes, ahead of time, which objects of a 3D scene can possibly be seen from each\n"
    "viewing cell, on one machine or a farm.";
constexpr const char* kFooter =
    "Settings: a flag, else the environment (--min-cell: PVSFARM_MIN_CELL), else --config FILE\n"
    "(TOML, a table a command), else the default.\n"
    "Exit codes: 0 ok, 1 command line, 2 I/O, 3 invalid input, 4 run time, 5 not supported,\n"
    "6 result incomplete (quarantined cells), 7 something declared hidden was seen,\n"
    "75 the disk failed under the journal, 130 interrupted.\n"
    "Examples:\n"
    "  pvsfarm inspect city.pvs\n"
    "  pvsfarm query city.pvs --at 12,3,1.7\n"
    "  pvsfarm COMMAND --help";

int report(const Error& error) {
  std::cerr << "pvsfarm: " << error.text << '\n';
  return static_cast<int>(error.kind);
}

LogLevel log_level(int verbosity) {
  if (verbosity < 0) return LogLevel::kWarning;
  return verbosity == 0 ? LogLevel::kInfo : LogLevel::kDebug;
}

void add_commands(CLI::App& app, CommandContext& context) {
  add_generate_command(app, context);
  add_bake_command(app, context);
  add_coordinate_command(app, context);
  add_keygen_command(app, context);
  add_status_command(app, context);
  add_pause_command(app, context);
  add_resume_command(app, context);
  add_drain_command(app, context);
  add_cancel_command(app, context);
  add_audit_command(app, context);
  add_inspect_command(app, context);
  add_query_command(app, context);
  add_explain_command(app, context);
  add_export_command(app, context);
  add_validate_command(app, context);
  add_diff_command(app, context);
  add_chart_command(app, context);
}

// What is wrong with the command line, in one line.
std::string text_of(const CLI::ParseError& error, const CLI::App& app) {
  const std::vector<std::string> rest = app.remaining();
  if (app.get_subcommands().empty() && !rest.empty()) return "no such command: " + rest.front();
  if (dynamic_cast<const CLI::ConfigError*>(&error) != nullptr)
    return std::string("file of --config: ") + error.what();
  const std::string text = error.what();
  return text.substr(0, text.find('\n'));
}

// Either the command to run is in `context`, or the exit code is returned.
std::optional<int> parse(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::FileError& error) {
    return report(io_error(text_of(error, app)));
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    return report({ErrorKind::kCommandLine, text_of(error, app) + "; see pvsfarm --help"});
  }
}

// Data that did not reach stdout is an error, not a shorter answer.
Status flush_stdout() {
  if (std::cout.flush() && std::fflush(stdout) == 0) return {};
  return io_error("standard output: cannot write (disk full or closed?)");
}

int run(int argc, char** argv) {
  CommandContext context;
  std::error_code no_proc;
  context.program = std::filesystem::read_symlink("/proc/self/exe", no_proc);
  if (no_proc) context.program = argv[0];
  CLI::App app(kDescription, "pvsfarm");
  app.footer(kFooter);
  app.set_version_flag("--version", "pvsfarm " PVSFARM_VERSION);
  app.require_subcommand(1);
  app.fallthrough();  // pvsfarm inspect city.pvs -q
  bool quiet = false;
  app.add_flag("-q,--quiet", quiet, "only warnings and errors on stderr");
  app.add_flag("-v,--verbose", context.verbosity, "more on stderr; twice: more still");
  std::string log_format = "text";
  app.add_option("--log-format", log_format,
                 "of the lines on stderr: text, or one JSON object each")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  add_commands(app, context);
  add_settings_sources(app);

  if (const auto exit_code = parse(app, argc, argv)) return *exit_code;
  if (quiet) context.verbosity = -1;
  const char* no_color = std::getenv("NO_COLOR");
  context.color = (no_color == nullptr || *no_color == '\0') && isatty(STDERR_FILENO) == 1;
  context.json_log = log_format == "json";
  set_up_log({.program = "pvsfarm",
              .level = log_level(context.verbosity),
              .color = context.color,
              .json = context.json_log});

  const Status status = context.run();
  if (status) return 0;
  if (!context.json_log) return report(status.error());
  log_event({.level = LogLevel::kError, .event = "failed", .text = status.error().text});
  return static_cast<int>(status.error().kind);
}

}  // namespace
}  // namespace pvsfarm

int main(int argc, char** argv) {
  try {
    const int exit_code = pvsfarm::run(argc, argv);
    const pvsfarm::Status flushed = pvsfarm::flush_stdout();
    return exit_code != 0 || flushed ? exit_code : pvsfarm::report(flushed.error());
  } catch (const std::exception& error) {
    return pvsfarm::report(pvsfarm::runtime_error(error.what()));
  }
}

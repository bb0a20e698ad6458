// `pvsfarm status OUT.pvs|ENDPOINT`: how far a running bake is.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>
#include <memory>
#include <thread>

#include "coordinator/cli/ask_coordinator.hpp"
#include "coordinator/cli/command.hpp"
#include "coordinator/cli/status_text.hpp"

namespace pvsfarm {
namespace {

constexpr const char* kToTop = "\033[H\033[J";  // of an empty screen

struct StatusOptions {
  CoordinatorAddress address;
  bool json = false, watch = false;
  double every_s = 2;
};

Result<StatusReport> ask(const CoordinatorAddress& address) {
  const Result<Message> answer = ask_coordinator(address, StatusGet{});
  if (!answer) return answer.error();
  const auto* report = std::get_if<StatusReport>(&*answer);
  if (report == nullptr) return runtime_error(address.name() + ": not a status in answer");
  return *report;
}

void print(const StatusReport& report, const StatusOptions& options, bool redraw) {
  std::cout << (redraw ? kToTop : "")
            << (options.json ? status_json(report) + '\n' : status_text(report)) << std::flush;
}

// Until the coordinator no longer answers. Errors: none ever answered.
Status watch(const StatusOptions& options) {
  const bool redraw = !options.json && isatty(STDOUT_FILENO) == 1;
  for (bool first = true;; first = false) {
    const Result<StatusReport> report = ask(options.address);
    if (!report && first) return report.error();
    if (!report) {
      if (!options.json) std::cout << options.address.name() << ": no longer at work\n";
      return {};
    }
    print(*report, options, redraw);
    if (!std::cout) return {};  // whoever read it has gone
    std::this_thread::sleep_for(std::chrono::duration<double>(options.every_s));
  }
}

}  // namespace

void add_status_command(CLI::App& app, CommandContext& context) {
  auto options = std::make_shared<StatusOptions>();
  CLI::App* command = app.add_subcommand("status", "how far a running bake is");
  add_coordinator_address(*command, options->address);
  command->add_flag("--json", options->json, "as one JSON object; with --watch one a line");
  command->add_flag("--watch", options->watch, "again and again, until the bake ends");
  command->add_option("--every", options->every_s, "seconds between two of --watch")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  command->footer(
      "Examples:\n  pvsfarm status city.pvs\n  pvsfarm status city.pvs --watch\n"
      "  pvsfarm status --connect tcp://host:5555 --key admin.key --server-key farm.pub");
  command->callback([&context, options] {
    context.run = [options]() -> Status {
      if (options->watch) return watch(*options);
      const Result<StatusReport> report = ask(options->address);
      if (!report) return report.error();
      print(*report, *options, false);
      return {};
    };
  });
}

}  // namespace pvsfarm

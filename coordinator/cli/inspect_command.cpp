// `pvsfarm inspect`: what a store holds, in a page.
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "coordinator/cli/command.hpp"
#include "coordinator/cli/inspect_summary.hpp"

namespace pvsfarm {
namespace {

struct InspectOptions {
  std::string store;
  bool json = false;
};

Status run_inspect(const InspectOptions& options) {
  auto store = StoreReader::open(options.store);
  if (!store) return store.error();
  const auto summary = summarise(**store);
  if (!summary) return summary.error();
  std::cout << (options.json ? summary_json(*summary) : summary_text(*summary));
  return {};
}

}  // namespace

void add_inspect_command(CLI::App& app, CommandContext& context) {
  auto options = std::make_shared<InspectOptions>();
  CLI::App* command = app.add_subcommand("inspect", "what a store holds, in a page");
  command->add_option("store", options->store, "the .pvs file")->required();
  command->add_flag("--json", options->json, "one JSON object instead of text");
  command->footer(
      "Examples:\n"
      "  pvsfarm inspect city.pvs\n"
      "  pvsfarm inspect city.pvs --json | jq .culled_percent");
  command->callback(
      [&context, options] { context.run = [options] { return run_inspect(*options); }; });
}

}  // namespace pvsfarm

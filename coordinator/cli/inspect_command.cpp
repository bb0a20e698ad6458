// `pvsfarm inspect`: what a store holds, in a page.
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "coordinator/cli/command.hpp"
#include "coordinator/cli/inspect_picture.hpp"
#include "coordinator/cli/inspect_summary.hpp"

namespace pvsfarm {
namespace {

struct InspectOptions {
  std::string store;
  bool json = false;
  PictureRequest picture;
  std::string color = "visible";
};

Status run_inspect(const InspectOptions& options) {
  auto store = StoreReader::open(options.store);
  if (!store) return store.error();
  const auto summary = summarise(**store);
  if (!summary) return summary.error();
  PictureRequest picture = options.picture;
  picture.by_gap = options.color == "gap";
  if (!picture.path.empty())
    if (Status status = draw_store(**store, *summary, picture); !status) return status;
  std::cout << (options.json ? summary_json(*summary) : summary_text(*summary));
  return {};
}

}  // namespace

void add_inspect_command(CLI::App& app, CommandContext& context) {
  auto options = std::make_shared<InspectOptions>();
  CLI::App* command = app.add_subcommand("inspect", "what a store holds, in a page");
  command->add_option("store", options->store, "the .pvs file")->required();
  command->add_flag("--json", options->json, "one JSON object instead of text");
  CLI::Option* picture = command->add_option("--picture", options->picture.path,
                                             "also draw it from above, as a PNG file");
  command->add_option("--color", options->color, "what colours the cells: visible or gap")
      ->check(CLI::IsMember({"visible", "gap"}))
      ->capture_default_str()
      ->needs(picture);
  command->add_option("--cell", options->picture.cell, "show what this cell sees")->needs(picture);
  command->footer(
      "Examples:\n"
      "  pvsfarm inspect city.pvs\n"
      "  pvsfarm inspect city.pvs --picture city.png --cell 17\n"
      "  pvsfarm inspect city.pvs --picture gap.png --color gap\n"
      "  pvsfarm inspect city.pvs --json | jq .culled_percent");
  command->callback(
      [&context, options] { context.run = [options] { return run_inspect(*options); }; });
}

}  // namespace pvsfarm

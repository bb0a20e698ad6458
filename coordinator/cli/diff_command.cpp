// `pvsfarm diff`: what differs between two stores.
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "coordinator/cli/command.hpp"
#include "coordinator/cli/store_diff.hpp"
#include "coordinator/cli/text.hpp"

namespace pvsfarm {
namespace {

using Json = nlohmann::ordered_json;

struct DiffOptions {
  std::string a, b;
  bool json = false;
};

std::string name_of(const DiffCell& cell) {
  const std::string path = path_text(cell.key);
  return "root " + std::to_string(cell.root_id) + (path.empty() ? "" : " path " + path);
}

void print_names(const char* label, const std::vector<std::string_view>& names) {
  if (names.empty()) return;
  std::cout << "  " << label << ' ' << grouped(names.size()) << ':';
  for (const std::string_view name : names) std::cout << ' ' << name;
  std::cout << '\n';
}

void print_only(const StoreDiff& diff, const DiffOptions& options) {
  for (const auto name : diff.objects_only_in_a)
    std::cout << "object " << name << ": only in " << options.a << '\n';
  for (const auto name : diff.objects_only_in_b)
    std::cout << "object " << name << ": only in " << options.b << '\n';
  for (const DiffCell& cell : diff.cells_only_in_a)
    std::cout << name_of(cell) << ": only in " << options.a << '\n';
  for (const DiffCell& cell : diff.cells_only_in_b)
    std::cout << name_of(cell) << ": only in " << options.b << '\n';
}

void print_text(const StoreDiff& diff, const DiffOptions& options) {
  if (diff.empty()) {
    std::cout << (diff.same_bytes ? "identical\n" : "same objects, cells and sets; other bytes\n");
    return;
  }
  print_only(diff, options);
  for (const ChangedCell& changed : diff.changed) {
    std::cout << name_of(changed.cell) << ": differs\n";
    if (changed.moved) std::cout << "  has another box\n";
    print_names("lost", changed.lost);
    print_names("gained", changed.gained);
    print_names("no longer certified seen", changed.seen_lost);
    print_names("newly certified seen", changed.seen_gained);
  }
  std::cout << grouped(diff.changed.size()) << " of "
            << counted(diff.common_cells, "common cell differs", "common cells differ") << "; "
            << grouped(diff.cells_only_in_a.size()) << " only in " << options.a << ", "
            << grouped(diff.cells_only_in_b.size()) << " only in " << options.b << '\n';
}

Json json_of(const std::vector<DiffCell>& cells) {
  Json out = Json::array();
  for (const DiffCell& cell : cells)
    out.push_back({{"cell", cell.index}, {"root", cell.root_id}, {"path", path_text(cell.key)}});
  return out;
}

void print_json(const StoreDiff& diff) {
  Json changed = Json::array();
  for (const ChangedCell& c : diff.changed)
    changed.push_back({{"root", c.cell.root_id},
                       {"path", path_text(c.cell.key)},
                       {"cell_in_a", c.cell.index},
                       {"cell_in_b", c.index_in_b},
                       {"moved", c.moved},
                       {"lost", c.lost},
                       {"gained", c.gained},
                       {"seen_lost", c.seen_lost},
                       {"seen_gained", c.seen_gained}});
  const Json out{{"same_bytes", diff.same_bytes},
                 {"same", diff.empty()},
                 {"objects_only_in_a", diff.objects_only_in_a},
                 {"objects_only_in_b", diff.objects_only_in_b},
                 {"cells_only_in_a", json_of(diff.cells_only_in_a)},
                 {"cells_only_in_b", json_of(diff.cells_only_in_b)},
                 {"common_cells", diff.common_cells},
                 {"changed", changed}};
  std::cout << out.dump(-1, ' ', false, Json::error_handler_t::replace) << '\n';
}

Status run_diff(const DiffOptions& options) {
  auto a = StoreReader::open(options.a);
  if (!a) return a.error();
  auto b = StoreReader::open(options.b);
  if (!b) return b.error();
  const auto diff = diff_stores(**a, **b);
  if (!diff) return diff.error();
  options.json ? print_json(*diff) : print_text(*diff, options);
  return {};
}

}  // namespace

void add_diff_command(CLI::App& app, CommandContext& context) {
  auto options = std::make_shared<DiffOptions>();
  CLI::App* command = app.add_subcommand("diff", "what differs between two stores");
  command->add_option("a", options->a, "a .pvs file")->required();
  command->add_option("b", options->b, "another")->required();
  command->add_flag("--json", options->json, "one JSON object instead of text");
  command->footer(
      "Cells are matched by root id and path of splits, objects by name. Says `identical` if no "
      "byte\n"
      "differs. The exit code is 0 whether or not they differ: a difference is an answer.\n"
      "Examples:\n"
      "  pvsfarm diff monday.pvs tuesday.pvs\n"
      "  pvsfarm diff a.pvs b.pvs --json | jq .same");
  command->callback(
      [&context, options] { context.run = [options] { return run_diff(*options); }; });
}

}  // namespace pvsfarm

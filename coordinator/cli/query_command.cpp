// `pvsfarm query`: what can be seen from a point.
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/pvs/hints_file.hpp"
#include "common/pvs/store_reader.hpp"
#include "coordinator/cli/command.hpp"
#include "coordinator/cli/file_cell.hpp"
#include "coordinator/cli/text.hpp"

namespace pvsfarm {
namespace {

struct QueryOptions {
  std::string store;
  std::vector<double> at;
  bool json = false, hints = false;
};

struct Answer {
  UpAxis up = UpAxis::kZ;
  Vec3 point{0};                     // in the file's coordinates
  std::vector<std::uint32_t> cells;  // that hold the point, ascending; `node` is the first
  StoredNode node;
  StoredSets sets;
  std::vector<StoreObject> objects;
  std::vector<std::byte> hints;  // of the cell, where asked for
  std::uint64_t triangles = 0, scene_triangles = 0;
};

Result<Box> bounds_of_roots(StoreReader& store) {
  Box bounds;
  for (std::uint32_t i = 0; i < store.node_count();) {
    const auto root = store.node(i);
    if (!root) return root.error();
    bounds.add(root->cell.bounds());
    i = root->end;
  }
  return bounds;
}

Error no_cell(StoreReader& store, const Vec3& point) {
  const std::string text = store.path() + ": no cell holds " + point_text(point);
  if (store.node_count() == 0) return invalid_input(text + "; it has no cells");
  const auto bounds = bounds_of_roots(store);
  if (!bounds) return bounds.error();
  const Box box = file_box(store.header().up, *bounds);
  return invalid_input(text + "; name a point in a cell: they lie between " + point_text(box.lo) +
                       " and " + point_text(box.hi));
}

Result<Answer> answer(StoreReader& store, const Vec3& point) {
  Answer found{.up = store.header().up, .point = point};
  auto cells = store.leaves_at(internal_from_file(found.up, point));
  if (!cells) return cells.error();
  if (cells->empty()) return no_cell(store, point);
  found.cells = std::move(*cells);
  auto node = store.node(found.cells.front());
  if (!node) return node.error();
  auto sets = store.sets(found.cells.front());
  if (!sets) return sets.error();
  auto objects = store.objects();
  if (!objects) return objects.error();
  found.node = std::move(*node);
  found.sets = std::move(*sets);
  found.objects = std::move(*objects);
  found.triangles = triangles_of(found.sets.visible, found.objects);
  for (const StoreObject& object : found.objects) found.scene_triangles += object.triangle_count;
  return found;
}

void print_text(const Answer& a) {
  std::cout << "cell " << a.node.index << ": root " << a.node.root_id << ", depth "
            << a.node.key.depth();
  if (!a.node.key.is_root()) std::cout << ", path " << path_text(a.node.key);
  const FileCell cell = file_cell(a.up, a.node.cell);
  std::cout << "; centre " << point_text(cell.center) << ", half " << point_text(cell.half) << '\n';
  if (a.cells.size() > 1) {
    std::cout << "the point is on a border, also of cell";
    for (std::size_t i = 1; i < a.cells.size(); ++i) std::cout << ' ' << a.cells[i];
    std::cout << '\n';
  }
  if (a.node.quarantined) std::cout << "quarantined: never evaluated, the parent's set stands in\n";
  std::cout << grouped(a.sets.visible.count()) << " of "
            << counted(a.objects.size(), "object", "objects") << " visible, "
            << grouped(a.triangles) << " of "
            << counted(a.scene_triangles, "triangle", "triangles");
  if (a.node.seen.objects > 0)
    std::cout << "; " << grouped(a.node.seen.objects) << " certified seen, gap "
              << fixed(100 * gap_of(a.node.visible.triangles, a.node.seen.triangles), 1)
              << " % of the triangles";
  std::cout << "\n\nid\ttriangles\tseen\t" << (a.hints.empty() ? "" : "degree\tsteradians\t")
            << "name\n";
  std::size_t position = 0;
  a.sets.visible.for_each([&](ObjectId id) {
    const StoreObject& object = a.objects[index_of(id)];
    std::cout << index_of(id) << '\t' << object.triangle_count << '\t'
              << (a.sets.seen.contains(id) ? "yes" : "-") << '\t';
    if (!a.hints.empty()) {
      const VisibilityHint hint = hint_at(a.hints, position++);
      std::cout << fixed(hint.degree / 255.0, 2) << '\t' << steradians_of(hint.size) << '\t';
    }
    std::cout << object.name << '\n';
  });
}

nlohmann::ordered_json json_of(const Vec3& v) { return {v.x, v.y, v.z}; }

void print_json(const Answer& a) {
  const FileCell cell = file_cell(a.up, a.node.cell);
  nlohmann::ordered_json visible = nlohmann::ordered_json::array();
  std::size_t position = 0;
  a.sets.visible.for_each([&](ObjectId id) {
    const StoreObject& object = a.objects[index_of(id)];
    visible.push_back({{"id", index_of(id)},
                       {"name", object.name},
                       {"triangles", object.triangle_count},
                       {"seen", a.sets.seen.contains(id)}});
    if (a.hints.empty()) return;
    const VisibilityHint hint = hint_at(a.hints, position++);
    visible.back()["degree"] = hint.degree;
    visible.back()["size"] = hint.size;
  });
  const nlohmann::ordered_json out{
      {"at", json_of(a.point)},
      {"cell", a.node.index},
      {"cells", a.cells},
      {"root", a.node.root_id},
      {"parent", a.node.parent},
      {"depth", a.node.key.depth()},
      {"quarantined", a.node.quarantined},
      {"center", json_of(cell.center)},
      {"axes", {json_of(cell.axes[0]), json_of(cell.axes[1]), json_of(cell.axes[2])}},
      {"half", json_of(cell.half)},
      {"triangles", a.triangles},
      {"seen_triangles", a.node.seen.triangles},
      {"gap", gap_of(a.node.visible.triangles, a.node.seen.triangles)},
      {"reason", to_string(a.node.reason)},
      {"visible", visible}};
  std::cout << out.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
}

Status run_query(const QueryOptions& options) {
  auto store = StoreReader::open(options.store);
  if (!store) return store.error();
  auto found = answer(**store, {options.at[0], options.at[1], options.at[2]});
  if (!found) return found.error();
  if (options.hints) {
    const auto hints = read_hints(**store);
    if (!hints) return hints.error();
    const auto row = hints->row(found->node.index);
    found->hints.assign(row.begin(), row.end());
  }
  options.json ? print_json(*found) : print_text(*found);
  return {};
}

}  // namespace

void add_query_command(CLI::App& app, CommandContext& context) {
  auto options = std::make_shared<QueryOptions>();
  CLI::App* command = app.add_subcommand("query", "what can be seen from a point");
  command->add_option("store", options->store, "the .pvs file")->required();
  command->add_option("--at", options->at, "a point in the scene file's own coordinates")
      ->required()
      ->delimiter(',')
      ->expected(3)
      ->type_name("X,Y,Z");
  command->add_flag("--hints", options->hints,
                    "how often and how large each object shows, from STORE.hints");
  command->add_flag("--json", options->json, "one JSON object instead of text");
  command->footer(
      "Answers with the leaf cell that holds the point: on a border, the lowest of those that do.\n"
      "A point in no cell is an error, exit code 3.\n"
      "Examples:\n"
      "  pvsfarm query city.pvs --at 12,3,1.7\n"
      "  pvsfarm query city.pvs --at 12,3,1.7 --json | jq -r '.visible[].name'");
  command->callback(
      [&context, options] { context.run = [options] { return run_query(*options); }; });
}

}  // namespace pvsfarm

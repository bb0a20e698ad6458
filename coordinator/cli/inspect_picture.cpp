#include "coordinator/cli/inspect_picture.hpp"

#include "coordinator/cli/text.hpp"
#include "coordinator/picture/top_view.hpp"

namespace pvsfarm {
namespace {

// What the chosen cell sees, or nothing.
Result<std::optional<VisibleSet>> chosen_set(StoreReader& store, const PictureRequest& request) {
  if (!request.cell) return std::optional<VisibleSet>();
  if (*request.cell >= store.node_count())
    return Error{ErrorKind::kCommandLine,
                 "--cell " + std::to_string(*request.cell) + ": " + store.path() + " has " +
                     counted(store.node_count(), "cell", "cells") + ", the first is 0"};
  auto sets = store.sets(*request.cell);
  if (!sets) return sets.error();
  return std::optional<VisibleSet>(std::move(sets->visible));
}

Status add_cells(StoreReader& store, const PictureRequest& request, TopView& view) {
  for (std::uint32_t i = 0; i < store.node_count(); ++i) {
    const auto node = store.node(i);
    if (!node) return node.error();
    const bool chosen = request.cell == i;
    if (!node->leaf && !chosen) continue;
    const double gap_percent = 100 * gap_of(node->visible.triangles, node->seen.triangles);
    view.cells.push_back({.footprint = footprint_of(node->cell),
                          .value = request.by_gap ? gap_percent : node->visible.objects,
                          .chosen = chosen});
  }
  return {};
}

void add_objects(const std::vector<StoreObject>& objects, const std::optional<VisibleSet>& chosen,
                 TopView& view) {
  for (std::uint32_t id = 0; id < objects.size(); ++id) {
    if (objects[id].box.empty()) continue;
    TopViewState state = TopViewState::kPlain;
    if (chosen)
      state = chosen->contains(ObjectId{id}) ? TopViewState::kVisible : TopViewState::kCulled;
    view.objects.push_back({.box = objects[id].box, .state = state});
  }
}

std::string subtitle_of(const StoreSummary& summary, const PictureRequest& request,
                        const std::optional<VisibleSet>& chosen,
                        const std::vector<StoreObject>& objects) {
  if (!chosen)
    return counted(summary.leaves, "cell", "cells") + "; on average one sees " +
           fixed(summary.visible_objects.mean, 0) + " of " +
           counted(summary.objects, "object", "objects");
  return "cell " + std::to_string(*request.cell) + " sees " + grouped(chosen->count()) + " of " +
         counted(summary.objects, "object", "objects") + ", " +
         grouped(triangles_of(*chosen, objects)) + " of " +
         counted(summary.triangles, "triangle", "triangles");
}

}  // namespace

Status draw_store(StoreReader& store, const StoreSummary& summary, const PictureRequest& request) {
  const auto chosen = chosen_set(store, request);
  if (!chosen) return chosen.error();
  const auto objects = store.objects();
  if (!objects) return objects.error();
  TopView view;
  view.title = ascii(store.path().substr(store.path().rfind('/') + 1)) + ": " +
               fixed(summary.culled_percent(), 1) + " % of all triangles culled";
  if (request.by_gap)
    view.value_label = "% of a cell's visible triangles that are not certified seen";
  view.subtitle = subtitle_of(summary, request, *chosen, *objects);
  add_objects(*objects, *chosen, view);
  if (Status status = add_cells(store, request, view); !status) return status;
  if (view.objects.empty() && view.cells.empty())
    return invalid_input(store.path() + ": has neither objects nor cells to draw");
  return render_top_view(view, request.path);
}

}  // namespace pvsfarm

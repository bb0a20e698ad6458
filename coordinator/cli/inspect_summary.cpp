#include "coordinator/cli/inspect_summary.hpp"

#include <algorithm>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <numeric>
#include <sstream>

#include "coordinator/cli/bake_summary.hpp"
#include "coordinator/cli/text.hpp"

namespace pvsfarm {

Spread spread_of(std::vector<std::uint64_t> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  return {.min = values.front(),
          .median = values[(values.size() - 1) / 2],
          .max = values.back(),
          .mean = sum / static_cast<double>(values.size())};
}

double StoreSummary::culled_percent() const {
  if (triangles == 0 || leaves == 0) return 0;
  return 100 * (1 - visible_triangles.mean / static_cast<double>(triangles));
}

Result<StoreSummary> summarise(StoreReader& store) {
  StoreSummary s{.file = store.path(),
                 .up = store.header().up,
                 .cells = store.node_count(),
                 .leaves = store.leaf_count(),
                 .roots = store.root_count(),
                 .objects = store.object_count(),
                 .file_bytes = store.file_bytes(),
                 .sizes = store.sizes(),
                 .settings_json = store.header().settings_json,
                 .scene_digest = store.header().scene_digest,
                 .bake_digest = store.header().bake_digest,
                 .file_digest = store.digest()};
  const auto objects = store.objects();
  if (!objects) return objects.error();
  for (const StoreObject& object : *objects) s.triangles += object.triangle_count;
  std::vector<std::uint64_t> visible_objects, visible_triangles, seen_objects, seen_triangles;
  for (std::uint32_t i = 0; i < store.node_count(); ++i) {
    const auto node = store.node(i);
    if (!node) return node.error();
    s.quarantined += node->quarantined ? 1 : 0;
    if (!node->leaf) continue;
    s.depth = std::max(s.depth, node->key.depth());
    visible_objects.push_back(node->visible.objects);
    visible_triangles.push_back(node->visible.triangles);
    seen_objects.push_back(node->seen.objects);
    seen_triangles.push_back(node->seen.triangles);
    s.leaf_objects += node->visible.objects;
    s.leaf_triangles += node->visible.triangles;
    s.leaf_seen += node->seen.objects;
    s.leaf_seen_triangles += node->seen.triangles;
    s.gap_of_objects += gap_of(node->visible.objects, node->seen.objects);
    s.gap_of_triangles += gap_of(node->visible.triangles, node->seen.triangles);
    ++s.leaves_by_reason[static_cast<std::size_t>(node->reason)];
  }
  s.visible_objects = spread_of(std::move(visible_objects));
  s.visible_triangles = spread_of(std::move(visible_triangles));
  s.seen_objects = spread_of(std::move(seen_objects));
  s.seen_triangles = spread_of(std::move(seen_triangles));
  s.any_seen = s.seen_objects.max > 0;
  return s;
}

namespace {

void put_spread(std::ostream& out, const char* label, const Spread& spread) {
  out << "  " << std::left << std::setw(22) << label << std::right;
  out << std::setw(12) << grouped(spread.min) << std::setw(12) << grouped(spread.median)
      << std::setw(14) << fixed(spread.mean, 1) << std::setw(12) << grouped(spread.max) << '\n';
}

std::string percent(double part) { return fixed(100 * part, 1) + " %"; }

int first_reason(const StoreSummary& s) {
  int first = 0;
  while (first < kLeafReasonCount && s.leaves_by_reason[static_cast<std::size_t>(first)] == 0)
    ++first;
  return first;
}

}  // namespace

std::string summary_text(const StoreSummary& s) {
  std::ostringstream out;
  out << s.file << ": " << counted(s.cells, "cell", "cells") << " ("
      << counted(s.leaves, "leaf", "leaves") << " of " << counted(s.roots, "root", "roots")
      << ", depth up to " << s.depth << "), " << counted(s.objects, "object", "objects") << ", "
      << counted(s.triangles, "triangle", "triangles") << '\n';
  if (s.quarantined > 0)
    out << "INCOMPLETE: " << counted(s.quarantined, "cell", "cells")
        << " never evaluated (quarantined: the parent's set stands in)\n";
  out << '\n'
      << "a leaf can see" << std::setw(22) << "min" << std::setw(12) << "median" << std::setw(14)
      << "mean" << std::setw(12) << "max\n";
  put_spread(out, "objects", s.visible_objects);
  put_spread(out, "triangles", s.visible_triangles);
  if (s.any_seen) {
    put_spread(out, "objects, certified", s.seen_objects);
    put_spread(out, "triangles, certified", s.seen_triangles);
  }
  out << "  culled on average     " << fixed(s.culled_percent(), 2) << " % of all triangles\n";
  if (s.any_seen)
    out << "  gap                   " << percent(gap_of(s.leaf_triangles, s.leaf_seen_triangles))
        << " of the triangles, " << percent(gap_of(s.leaf_objects, s.leaf_seen))
        << " of the objects visible are not certified; mean of the leaves "
        << percent(s.gap_of_triangles / s.leaves) << ", " << percent(s.gap_of_objects / s.leaves)
        << '\n';
  else
    out << "  gap                   unknown: nothing is certified\n";
  out << '\n';
  for (int i = 0; i < kLeafReasonCount; ++i)
    if (const std::uint64_t count = s.leaves_by_reason[static_cast<std::size_t>(i)]; count > 0)
      out << (i == first_reason(s) ? "leaves    " : "          ") << grouped(count) << ' '
          << words_for(LeafReason(i)) << '\n';
  out << "size      " << bytes_text(s.file_bytes) << "; a cell takes "
      << fixed(s.per_cell(s.sizes.set_bytes), 1) << " bytes for its sets and "
      << fixed(s.per_cell(s.sizes.geometry_bytes), 1) << " for its geometry\n";
  out << "up axis   " << (s.up == UpAxis::kY ? "y" : "z") << '\n';
  out << "settings  " << (s.settings_json.empty() ? "none recorded" : s.settings_json) << '\n';
  out << "scene     " << s.scene_digest.hex() << '\n';
  out << "bake      " << s.bake_digest.hex() << '\n';
  out << "store     " << s.file_digest.hex() << '\n';
  return out.str();
}

std::string summary_json(const StoreSummary& s) {
  using Json = nlohmann::ordered_json;
  const auto json_of = [](const Spread& spread) {
    return Json{
        {"min", spread.min}, {"median", spread.median}, {"mean", spread.mean}, {"max", spread.max}};
  };
  Json settings = Json::parse(s.settings_json, nullptr, false);
  if (settings.is_discarded()) settings = s.settings_json;
  Json reasons = Json::object();
  for (int i = 1; i < kLeafReasonCount; ++i)
    reasons[to_string(LeafReason(i))] = s.leaves_by_reason[static_cast<std::size_t>(i)];
  const double leaves = std::max(1u, s.leaves);
  const Json gap{{"triangles", gap_of(s.leaf_triangles, s.leaf_seen_triangles)},
                 {"objects", gap_of(s.leaf_objects, s.leaf_seen)},
                 {"mean_triangles", s.gap_of_triangles / leaves},
                 {"mean_objects", s.gap_of_objects / leaves}};
  const Json out{{"file", s.file},
                 {"up", s.up == UpAxis::kY ? "y" : "z"},
                 {"cells", s.cells},
                 {"leaves", s.leaves},
                 {"roots", s.roots},
                 {"depth", s.depth},
                 {"quarantined", s.quarantined},
                 {"objects", s.objects},
                 {"triangles", s.triangles},
                 {"visible_objects", json_of(s.visible_objects)},
                 {"visible_triangles", json_of(s.visible_triangles)},
                 {"seen_objects", s.any_seen ? json_of(s.seen_objects) : Json(nullptr)},
                 {"seen_triangles", s.any_seen ? json_of(s.seen_triangles) : Json(nullptr)},
                 {"culled_percent", s.culled_percent()},
                 {"gap", s.any_seen ? gap : Json(nullptr)},
                 {"leaves_by_reason", reasons},
                 {"file_bytes", s.file_bytes},
                 {"set_bytes_per_cell", s.per_cell(s.sizes.set_bytes)},
                 {"geometry_bytes_per_cell", s.per_cell(s.sizes.geometry_bytes)},
                 {"settings", settings},
                 {"digests",
                  {{"scene", s.scene_digest.hex()},
                   {"bake", s.bake_digest.hex()},
                   {"store", s.file_digest.hex()}}}};
  return out.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace pvsfarm

#include "coordinator/tree/tree.hpp"

#include <algorithm>

#include "common/base/check.hpp"

namespace pvsfarm {

TreeScene TreeScene::of(const Scene& scene) {
  TreeScene out;
  out.occludees = VisibleSet::all(scene.object_count());
  out.triangle_counts.reserve(scene.object_count());
  for (std::uint32_t i = 0; i < scene.object_count(); ++i) {
    const ObjectRecord& object = scene.object(ObjectId{i});
    if (!object.occludee) out.occludees.remove(ObjectId{i});
    out.triangle_counts.push_back(object.triangle_count);
  }
  return out;
}

Tree::Tree(TreeScene scene, std::vector<Cell> roots, const SubdivisionSettings& subdivision)
    : scene_(std::move(scene)), roots_(std::move(roots)), subdivision_(subdivision) {
  PVS_CHECK_EQ(scene_.triangle_counts.size(), scene_.occludees.universe());
  open_.reserve(roots_.size());
  for (std::size_t i = 0; i < roots_.size(); ++i)
    open_.emplace(CellKey{static_cast<std::uint32_t>(i), 1}, nullptr);
}

std::optional<Cell> Tree::cell(const CellKey& key) const {
  if (key.root >= roots_.size() || key.path == 0 || key.depth() > kMaxDepth) return std::nullopt;
  Cell cell = roots_[key.root];
  for (int bit = key.depth() - 1; bit >= 0; --bit) {
    const int axis = cell.longest_axis();
    if (!can_split(cell, axis)) return std::nullopt;
    auto [low, high] = split(cell, axis);
    cell = key.path >> bit & 1 ? high : low;
  }
  return cell;
}

std::uint64_t Tree::triangles(const VisibleSet& visible) const {
  std::uint64_t sum = 0;
  visible.for_each([&](ObjectId id) { sum += scene_.triangle_counts[index_of(id)]; });
  return sum;
}

LeafReason leaf_reason(const CellFigures& figures, const SubdivisionSettings& settings) {
  const std::uint64_t pvs = figures.triangles, point = figures.point_triangles;
  if (settings.budget_triangles == 0) return LeafReason::kNoBudget;
  if (pvs <= settings.budget_triangles) return LeafReason::kBudgetMet;
  const Cell& cell = figures.cell;
  const int axis = cell.longest_axis();
  if (figures.depth >= kMaxDepth || cell.hi[axis] - cell.lo[axis] < 2 * settings.min_cell_m ||
      !can_split(cell, axis))
    return LeafReason::kTooSmall;
  if (settings.split_gain == 0) return LeafReason::kNone;
  // Whatever part holds that viewpoint stays over the budget.
  if (point > settings.budget_triangles) return LeafReason::kPointOverBudget;
  const double rest = point < pvs ? static_cast<double>(pvs - point) : 0;
  if (point > 0 && rest <= settings.split_gain * static_cast<double>(pvs))
    return LeafReason::kNothingToGain;
  return LeafReason::kNone;
}

std::vector<CellKey> Tree::open_cells() const {
  std::vector<CellKey> keys;
  keys.reserve(open_.size());
  for (const auto& [key, parent] : open_) keys.push_back(key);
  std::sort(keys.begin(), keys.end());
  return keys;
}

SharedSet Tree::parent_set(const CellKey& key) const {
  const auto found = open_.find(key);
  PVS_CHECK(found != open_.end());
  return found->second;
}

VisibleSet Tree::decoded_parent(const CellKey& key) const {
  const SharedSet bytes = parent_set(key);
  if (!bytes) return scene_.occludees;
  Result<VisibleSet> set = decode_visible_set(*bytes, object_count());
  PVS_CHECK(set.ok());  // our own encoding
  return std::move(set).value();
}

Result<Tree::Merged> Tree::merge(const CellDelta& delta) {
  const CellKey& key = delta.key;
  Merged merged{.visible = decoded_parent(key)};
  for (const VisibleSet* set : {&delta.hidden, &delta.seen})
    if (set->universe() != object_count())
      return invalid_input("delta over " + std::to_string(set->universe()) +
                           " objects, scene has " + std::to_string(object_count()));
  if (!delta.hidden.subset_of(merged.visible))
    return invalid_input("delta hides objects that the parent's set does not hold");
  merged.visible.remove_all(delta.hidden);
  if (!delta.seen.subset_of(merged.visible))
    return invalid_input("delta has seen objects that the cell's set does not hold");
  const std::optional<Cell> box = cell(key);
  PVS_CHECK(box.has_value());
  merged.triangles = triangles(merged.visible);
  merged.reason =
      leaf_reason({*box, key.depth(), merged.triangles, delta.point_triangles}, subdivision_);
  open_.erase(key);
  if (merged.split()) {
    const auto bytes = std::make_shared<const std::vector<std::byte>>(encode(merged.visible));
    for (const int half : {0, 1}) open_.emplace(key.child(half), bytes);
  }
  return merged;
}

void Tree::give_up(const CellKey& key) { PVS_CHECK_EQ(open_.erase(key), 1u); }

}  // namespace pvsfarm

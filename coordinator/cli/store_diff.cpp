#include "coordinator/cli/store_diff.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace pvsfarm {
namespace {

constexpr std::uint32_t kNone = 0xffffffff;

// For each object of one store the one of the other, or kNone.
struct ObjectMatch {
  std::vector<std::uint32_t> b_of_a, a_of_b;
};

// Names in order, equal ones in the order of the scene file.
std::vector<std::uint32_t> by_name(const std::vector<StoreObject>& objects) {
  std::vector<std::uint32_t> order(objects.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t x, std::uint32_t y) {
    return std::pair(objects[x].name, objects[x].file_index) <
           std::pair(objects[y].name, objects[y].file_index);
  });
  return order;
}

ObjectMatch match_objects(const std::vector<StoreObject>& a, const std::vector<StoreObject>& b) {
  ObjectMatch match{std::vector(a.size(), kNone), std::vector(b.size(), kNone)};
  const auto order_a = by_name(a), order_b = by_name(b);
  for (std::size_t i = 0, j = 0; i < order_a.size() && j < order_b.size();) {
    const auto name_a = a[order_a[i]].name, name_b = b[order_b[j]].name;
    if (name_a == name_b) {
      match.b_of_a[order_a[i]] = order_b[j];
      match.a_of_b[order_b[j]] = order_a[i];
    }
    i += name_a <= name_b ? 1 : 0;
    j += name_b <= name_a ? 1 : 0;
  }
  return match;
}

std::vector<std::string_view> unmatched(const std::vector<StoreObject>& objects,
                                        const std::vector<std::uint32_t>& other) {
  std::vector<std::string_view> names;
  for (std::size_t i = 0; i < objects.size(); ++i)
    if (other[i] == kNone) names.push_back(objects[i].name);
  return names;
}

// Names of the objects of `here` that are not in `there`; with `among`, only of those in it.
std::vector<std::string_view> only_here(const VisibleSet& here, const VisibleSet& there,
                                        const std::vector<std::uint32_t>& there_of_here,
                                        const std::vector<StoreObject>& objects_here,
                                        const VisibleSet* among = nullptr) {
  std::vector<std::string_view> names;
  here.for_each([&](ObjectId id) {
    const std::uint32_t other = there_of_here[index_of(id)];
    if (among != nullptr && (other == kNone || !among->contains(ObjectId{other}))) return;
    if (other == kNone || !there.contains(ObjectId{other}))
      names.push_back(objects_here[index_of(id)].name);
  });
  return names;
}

using CellName = std::pair<std::int64_t, std::uint64_t>;  // root id, path

Result<std::vector<std::pair<CellName, std::uint32_t>>> sorted_cells(StoreReader& store) {
  std::vector<std::pair<CellName, std::uint32_t>> cells;
  for (std::uint32_t i = 0; i < store.node_count(); ++i) {
    const auto node = store.node(i);
    if (!node) return node.error();
    cells.emplace_back(CellName{node->root_id, node->key.path}, i);
  }
  std::sort(cells.begin(), cells.end());
  return cells;
}

DiffCell diff_cell(const StoredNode& node) { return {node.root_id, node.key, node.index}; }

class Comparison {
 public:
  Comparison(StoreReader& a, StoreReader& b) : a_(a), b_(b) {}
  Result<StoreDiff> run();

 private:
  Status compare_objects();
  Status compare_common(std::uint32_t in_a, std::uint32_t in_b);

  StoreReader &a_, &b_;
  std::vector<StoreObject> objects_a_, objects_b_;
  ObjectMatch match_;
  StoreDiff diff_;
};

Status Comparison::compare_objects() {
  auto objects_a = a_.objects();
  if (!objects_a) return objects_a.error();
  auto objects_b = b_.objects();
  if (!objects_b) return objects_b.error();
  objects_a_ = std::move(*objects_a);
  objects_b_ = std::move(*objects_b);
  match_ = match_objects(objects_a_, objects_b_);
  diff_.objects_only_in_a = unmatched(objects_a_, match_.b_of_a);
  diff_.objects_only_in_b = unmatched(objects_b_, match_.a_of_b);
  return {};
}

Status Comparison::compare_common(std::uint32_t in_a, std::uint32_t in_b) {
  const auto node_a = a_.node(in_a), node_b = b_.node(in_b);
  if (!node_a) return node_a.error();
  if (!node_b) return node_b.error();
  const auto sets_a = a_.sets(in_a), sets_b = b_.sets(in_b);
  if (!sets_a) return sets_a.error();
  if (!sets_b) return sets_b.error();
  ChangedCell changed{
      .cell = diff_cell(*node_a), .index_in_b = in_b, .moved = node_a->cell != node_b->cell};
  changed.lost = only_here(sets_a->visible, sets_b->visible, match_.b_of_a, objects_a_);
  changed.gained = only_here(sets_b->visible, sets_a->visible, match_.a_of_b, objects_b_);
  changed.seen_lost =
      only_here(sets_a->seen, sets_b->seen, match_.b_of_a, objects_a_, &sets_b->visible);
  changed.seen_gained =
      only_here(sets_b->seen, sets_a->seen, match_.a_of_b, objects_b_, &sets_a->visible);
  ++diff_.common_cells;
  if (changed.moved || !changed.lost.empty() || !changed.gained.empty() ||
      !changed.seen_lost.empty() || !changed.seen_gained.empty())
    diff_.changed.push_back(std::move(changed));
  return {};
}

Result<StoreDiff> Comparison::run() {
  diff_.same_bytes = a_.digest() == b_.digest();
  if (Status status = compare_objects(); !status) return status.error();
  const auto cells_a = sorted_cells(a_);
  if (!cells_a) return cells_a.error();
  const auto cells_b = sorted_cells(b_);
  if (!cells_b) return cells_b.error();
  std::size_t i = 0, j = 0;
  while (i < cells_a->size() || j < cells_b->size()) {
    const bool left_a = i < cells_a->size(), left_b = j < cells_b->size();
    if (left_a && (!left_b || cells_a->at(i).first < cells_b->at(j).first)) {
      diff_.cells_only_in_a.push_back(diff_cell(*a_.node(cells_a->at(i++).second)));
    } else if (left_b && (!left_a || cells_b->at(j).first < cells_a->at(i).first)) {
      diff_.cells_only_in_b.push_back(diff_cell(*b_.node(cells_b->at(j++).second)));
    } else {
      const Status status = compare_common(cells_a->at(i++).second, cells_b->at(j++).second);
      if (!status) return status.error();
    }
  }
  return std::move(diff_);
}

}  // namespace

Result<StoreDiff> diff_stores(StoreReader& a, StoreReader& b) { return Comparison(a, b).run(); }

}  // namespace pvsfarm

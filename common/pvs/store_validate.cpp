#include "common/pvs/store_validate.hpp"

#include <vector>

#include "common/pvs/pvs_load.h"
#include "common/pvs/pvs_reader.h"
#include "common/pvs/store_reader.hpp"

namespace pvsfarm {
namespace {

class Validation {
 public:
  explicit Validation(StoreReader& reader) : reader_(reader) {}
  Status run();

 private:
  Status check_digest();
  Status check_node(const StoredNode& node);
  Status check_sets(const StoredNode& node, const StoredSets& sets);
  Status check_location();
  Error wrong(const StoredNode& node, const std::string& what) const;

  StoreReader& reader_;
  const pvs_store& raw_ = reader_.raw();
  std::vector<StoreObject> objects_;
  std::vector<StoredNode> ancestors_;
  std::vector<bool> is_root_;
  std::uint32_t leaf_count_ = 0;
};

Status Validation::check_digest() {
  pvs_damage where{};
  if (pvs_verify(&raw_, &where) != PVS_OK) return reader_.damage(where.what, where.offset);
  const auto covered = std::as_bytes(std::span(
      raw_.bytes, static_cast<std::size_t>(raw_.size - PVS_TAIL_BYTES + PVS_TAIL_DIGEST)));
  if (digest_of(covered) != reader_.digest())
    return reader_.damage("the digest", raw_.size - PVS_TAIL_BYTES + PVS_TAIL_DIGEST);
  return {};
}

Error Validation::wrong(const StoredNode& node, const std::string& what) const {
  const unsigned char* entry = entry_of(&raw_, pvs_block_of_node(&raw_, node.index));
  return reader_.damage("cell " + std::to_string(node.index) + " " + what + ", in the chunk",
                        load_u64(entry + PVS_ENTRY_OFFSET));
}

// Where the node stands in the hierarchy.
Status Validation::check_node(const StoredNode& node) {
  if (!ancestors_.empty() && !(ancestors_.back().key < node.key))
    return wrong(node, "does not follow the cell before it");
  while (!ancestors_.empty() && ancestors_.back().end <= node.index) ancestors_.pop_back();
  if (node.key.is_root()) {
    if (!ancestors_.empty() || node.parent != -1) return wrong(node, "is a root with a parent");
  } else {
    if (ancestors_.empty()) return wrong(node, "has lost its parent");
    const StoredNode& parent = ancestors_.back();
    if (node.parent != parent.index || node.key.parent() != parent.key ||
        node.root_id != parent.root_id || node.end > parent.end || parent.leaf)
      return wrong(node, "does not fit its parent");
  }
  if (node.leaf != (node.end == node.index + 1))
    return wrong(node, node.leaf ? "is a leaf with children" : "has no children and is no leaf");
  if (node.leaf != (node.reason != LeafReason::kNone) ||
      (node.leaf && node.quarantined) != (node.reason == LeafReason::kGivenUp))
    return wrong(node, "gives a reason that does not fit it");
  is_root_.push_back(node.key.is_root());
  leaf_count_ += node.leaf ? 1 : 0;
  return {};
}

Status Validation::check_sets(const StoredNode& node, const StoredSets& sets) {
  const auto size_of = [&](const VisibleSet& set) {
    return SetSize{set.count(), static_cast<std::uint32_t>(triangles_of(set, objects_))};
  };
  if (node.visible != size_of(sets.visible) || node.seen != size_of(sets.seen))
    return wrong(node, "counts other objects or triangles than its sets hold");
  return {};
}

Status Validation::check_location() {
  std::vector<bool> located(is_root_.size(), false);
  const auto offset = static_cast<std::uint64_t>(raw_.locate_roots - raw_.bytes);
  for (std::uint32_t i = 0; i < raw_.root_count; ++i) {
    const std::uint32_t node = load_u32(raw_.locate_roots + std::uint64_t{i} * 4);
    if (node >= located.size() || located[node])
      return reader_.damage("a root in the location of points", offset);
    located[node] = true;
  }
  if (located != is_root_) return reader_.damage("the location of points", offset);
  // And each is found.
  for (std::uint32_t i = 0; i < is_root_.size(); ++i) {
    if (!is_root_[i]) continue;
    const Result<StoredNode> root = reader_.node(i);
    if (!root) return root.error();
    std::uint32_t count = 0;
    const Vec3 center = file_from_internal(reader_.header().up, root->cell.center());
    const double p[3] = {center.x, center.y, center.z};
    if (pvs_find(&raw_, p, nullptr, 0, &count) != PVS_OK || count == 0)
      return wrong(*root, "cannot be located");
  }
  return {};
}

Status Validation::run() {
  if (Status status = check_digest(); !status) return status;
  auto objects = reader_.objects();
  if (!objects) return objects.error();
  objects_ = std::move(*objects);
  for (std::uint32_t i = 0; i < reader_.node_count(); ++i) {
    const Result<StoredNode> node = reader_.node(i);
    if (!node) return node.error();
    if (Status status = check_node(*node); !status) return status;
    ancestors_.push_back(*node);
    if (!node->leaf) continue;  // its sets are those of its leaves
    const Result<StoredSets> sets = reader_.sets(i);
    if (!sets) return sets.error();
    if (Status status = check_sets(*node, *sets); !status) return status;
  }
  if (leaf_count_ != reader_.leaf_count())
    return reader_.damage("the number of leaves", raw_.size - PVS_TAIL_BYTES + PVS_TAIL_LEAVES);
  return check_location();
}

}  // namespace

Status validate_store(const std::string& path) {
  auto reader = StoreReader::open(path);
  if (!reader) return reader.error();
  return Validation(**reader).run();
}

}  // namespace pvsfarm

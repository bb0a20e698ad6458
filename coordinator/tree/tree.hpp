// The hierarchy of cells as it grows: which cells are open (to be evaluated), from which set each
// starts, and whether a merged cell is split.
//
// Source: theory part G. A child starts from its parent's PVS, so PVS(child) is a subset of
// PVS(parent) by construction, and children tile their parent bit for bit (cell.hpp).
// Shape: keeps only what open cells need: a parent's set in compact bytes, shared by its two
// children, until both are merged. Merged leaves are in the journal, not here.
// Threads: one.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "common/base/ids.hpp"
#include "common/base/result.hpp"
#include "common/cells/cell.hpp"
#include "common/pvs/delta.hpp"
#include "common/pvs/leaf_reason.hpp"
#include "common/pvs/settings.hpp"
#include "common/pvs/visible_set.hpp"
#include "common/scene/scene.hpp"

namespace pvsfarm {

inline constexpr int kMaxDepth = 62;  // what a CellKey can name

struct CellKeyHash {
  std::size_t operator()(const CellKey& key) const {
    std::uint64_t h = key.path * 0x9e3779b97f4a7c15ull ^ (key.root + 0x7f4a7c15ull);
    h ^= h >> 29;
    return static_cast<std::size_t>(h * 0xbf58476d1ce4e5b9ull);
  }
};

// What the tree must know of a scene.
struct TreeScene {
  VisibleSet occludees;                        // where every root starts
  std::vector<std::uint32_t> triangle_counts;  // by object
  static TreeScene of(const Scene& scene);
};

// What the stopping rule looks at: nothing that a resumed bake would not know.
struct CellFigures {
  Cell cell;
  int depth = 0;
  std::uint64_t triangles = 0;        // of its PVS
  std::uint64_t point_triangles = 0;  // of the viewpoint that sees the most; 0: not known
};

// The stopping rule: kNone if the cell is to be split, else what stands against it.
// A split_gain of 0 splits whatever a viewpoint sees, as the papers do.
// Source: theory G. Samples steer it; soundness does not depend on any of it.
LeafReason leaf_reason(const CellFigures& figures, const SubdivisionSettings& settings);

// A parent's PVS in canonical bytes; null: every occludee.
using SharedSet = std::shared_ptr<const std::vector<std::byte>>;

class Tree {
 public:
  Tree(TreeScene scene, std::vector<Cell> roots, const SubdivisionSettings& subdivision);

  std::uint32_t object_count() const { return scene_.occludees.universe(); }
  const VisibleSet& occludees() const { return scene_.occludees; }
  std::size_t root_count() const { return roots_.size(); }

  // The box of a node; none if the key names no node that splitting could make.
  std::optional<Cell> cell(const CellKey& key) const;
  const SubdivisionSettings& subdivision() const { return subdivision_; }
  std::uint64_t triangles(const VisibleSet& visible) const;

  bool is_open(const CellKey& key) const { return open_.count(key) != 0; }
  std::size_t open_count() const { return open_.size(); }
  std::vector<CellKey> open_cells() const;  // in canonical order
  // Requires: the cell is open.
  SharedSet parent_set(const CellKey& key) const;
  VisibleSet decoded_parent(const CellKey& key) const;

  struct Merged {
    VisibleSet visible;  // the PVS
    std::uint64_t triangles = 0;
    LeafReason reason = LeafReason::kNone;
    bool split() const { return reason == LeafReason::kNone; }  // its two children are open now
  };
  // Closes an open cell: PVS = parent's PVS minus `hidden`. Requires: the cell is open.
  // Errors: kInvalidInput, and nothing is changed, if `hidden` is not a subset of the parent's PVS,
  // or `seen` not one of the cell's own.
  Result<Merged> merge(const CellDelta& delta);
  // Closes an open cell that nobody could evaluate: a leaf with its parent's PVS.
  void give_up(const CellKey& key);

 private:
  TreeScene scene_;
  std::vector<Cell> roots_;
  SubdivisionSettings subdivision_;
  std::unordered_map<CellKey, SharedSet, CellKeyHash> open_;
};

}  // namespace pvsfarm

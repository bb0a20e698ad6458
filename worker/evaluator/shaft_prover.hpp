// A prover of the cascade: surfaces between parts of the cell and parts of what is open, without
// planes. The cell and an object are halved in turn, until surfaces block every pair of parts, or a
// line that nothing blocks turns up, or it does not pay.
//
// Source: docs/algorithm.md A.15.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/cells/cell.hpp"
#include "common/pvs/visible_set.hpp"
#include "common/scene/scene.hpp"
#include "worker/evaluator/evidence.hpp"
#include "worker/visibility/sampler.hpp"
#include "worker/visibility/shaft_cover.hpp"
#include "worker/visibility/surface_chain.hpp"

namespace pvsfarm {

// How hard it tries. None of it matters for soundness.
struct ShaftEffort {
  double near_m = 0;
  std::uint32_t shafts_an_object = 2000;
  int halvings = 20;  // in a row, of cell and object together
  // Edges looked at, an upper bound of all it does in a cell: this part of it, and as much as what
  // it settled is of what was open, in triangles.
  double first_share = 0.04;
  std::uint64_t most_edges = 60'000'000;
};

// From an eye in the cell to a triangle of an object, and no surface is met in between: not checked
// against anything else.
struct ClearLine {
  Vec3 eye{0};  // world
  SightCandidate candidate;
};

struct ShaftWork {
  std::uint64_t shafts = 0, edges = 0;  // asked about; looked at for that
};

// Threads: one object, one thread.
class ShaftProver {
 public:
  ShaftProver(const Scene& scene, const ShaftEffort& effort);  // keeps a reference to the scene

  // Removes from `open`, and from `visible`, the objects that no point of the cell can see.
  // `evidence` gets no parts for what is hidden by shafts: they end on no plane.
  ShaftWork run(const Cell& cell, VisibleSet& visible, VisibleSet& open, Evidence* evidence);
  // Those that kept objects open in the last run.
  std::span<const ClearLine> clear_lines() const { return clear_lines_; }

 private:
  struct TriangleBox {
    Box box;                 // local
    std::uint32_t triangle;  // of the object
  };
  // Part of an object: what its triangles fill of a box.
  struct Part {
    Box box;                 // local, around that
    std::size_t first, end;  // into boxes_; none: all of it is full
  };
  void visit(std::uint32_t node, ShaftCover::Candidates candidates, VisibleSet& open);
  bool object_hidden(ObjectId id, const ShaftCover::Candidates& candidates);
  bool pair_hidden(const Box& eyes, const Part& part, ShaftCover::Candidates candidates,
                   int halvings);
  bool halves_hidden(const Box& eyes, const Part& part, const ShaftCover::Candidates& candidates,
                     int halvings);
  Part half_of(const Part& part, const Box& half);
  Part whole(ObjectId id);
  // The triangle of the object that the target is on; none: it is just in the part's box.
  std::optional<std::uint32_t> aim(const Part& part, Vec3& target) const;
  void note_clear(const Vec3& eye, const Vec3& target, std::uint32_t triangle);
  bool pays() const;

  const Scene& scene_;
  ShaftEffort effort_;
  SurfaceChainBuilder chain_builder_;
  SurfaceChain chain_;
  ShaftCover cover_;
  // Of this cell:
  const Cell* cell_ = nullptr;
  const CellFrame* frame_ = nullptr;
  Box eyes_;
  std::uint64_t shafts_ = 0, open_triangles_ = 0, settled_triangles_ = 0;
  // Of the object that is being tested:
  ObjectId object_{};
  unsigned within_ = 0;
  std::uint32_t shafts_left_ = 0;
  bool given_up_ = false;
  std::vector<TriangleBox> boxes_;  // a stack
  std::vector<ClearLine> clear_lines_;
};

}  // namespace pvsfarm

// A prover of the cascade: the occlusion sweep, for occluders that fuse only near a plane (leaves,
// fences, many small objects), none of which hides anything alone.
//
// Face by face, front to back: a plane takes over what the one before it certifies (re-projection),
// then the Projections of the occluders around it are added, those alone that are not hidden yet.
// Source: Durand 2000, 5.2; theory B.2, B.4; docs/algorithm.md.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "common/cells/cell.hpp"
#include "common/pvs/delta.hpp"
#include "common/pvs/settings.hpp"
#include "common/pvs/visible_set.hpp"
#include "worker/evaluator/evidence.hpp"
#include "worker/visibility/coverage_bits.hpp"
#include "worker/visibility/occluder_tree.hpp"
#include "worker/visibility/plane_choice.hpp"
#include "worker/visibility/slab_screen.hpp"

namespace pvsfarm {

// How hard it tries. None of it matters for soundness.
struct SweepEffort {
  int columns_px = 1024;  // of a map, along; half as many across
  int most_planes = 160;  // a face
  double extent = 1.1;    // half a map's side over the cell's half side and the distance
  double near_m = 0;
  int splits = 3;  // Rule S
};

SweepEffort sweep_effort(const EvaluatorSettings& settings);

// Threads: one object, one thread.
class SweepProver {
 public:
  // Keeps a reference.
  SweepProver(const Scene& scene, const SweepEffort& effort);

  // Removes from `open` and `visible` the objects of `open` that no point of the cell can see.
  // Adds to the statistics what it did; not which objects it settled.
  // `evidence`, if its object is in `open`, is told the planes that hide it; what was drawn on them
  // and on those before them is too much to tell.
  void run(const Cell& cell, VisibleSet& visible, VisibleSet& open, CellStatistics& statistics,
           Evidence* evidence = nullptr);
  // What it worked on last.
  MapsUsed maps_used() const;

 private:
  // What all faces of a cell share.
  struct Sweep {
    const CellFrame& frame;
    const OccludeeExtent& extent;
    double ground_depth;
    VisibleSet& open;
    CellStatistics& statistics;
    Evidence* evidence;
  };
  void sweep_face(const Sweep& sweep, Face face);
  void add_occluders(const Sweep& sweep, const PolygonPlane& plane, double before,
                     CoverageBits& map);
  void add_occluder(const Sweep& sweep, const Occluder& occluder, const PolygonPlane& plane,
                    CoverageBits& map);
  std::vector<SweepPlane> planes_for(const CellFrame& frame, Face face,
                                     const OccludeeExtent& extent) const;

  const Scene& scene_;
  SweepEffort effort_;
  std::optional<OccluderTree> tree_;  // made when a cell wants it first
  std::vector<CoverageBits> maps_;    // of all faces, nearest first within a face
  struct FaceMaps {
    Face face;
    std::size_t first = 0, count = 0;
  };
  std::vector<FaceMaps> faces_;
  std::size_t map_count_ = 0;
  // Room for work.
  LocalOccluders occluders_;
  CoverageList coverages_;
  RowShape shape_;
  struct Visit {
    int level;
    std::uint32_t block;
  };
  std::vector<Visit> stack_;
};

}  // namespace pvsfarm

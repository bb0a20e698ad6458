// A prover of the cascade: extended Projections on planes around the cell.
//
// Source: Durand 2000, with the corrections of docs/algorithm.md.
#pragma once

#include <memory>
#include <vector>

#include "common/cells/cell.hpp"
#include "common/pvs/delta.hpp"
#include "common/pvs/settings.hpp"
#include "worker/evaluator/occludee_hierarchy.hpp"
#include "worker/visibility/occluder_ranking.hpp"
#include "worker/visibility/occluder_screen.hpp"
#include "worker/visibility/rasteriser.hpp"
#include "worker/visibility/surface_chain.hpp"
#include "worker/visibility/surface_cover.hpp"

namespace pvsfarm {

// How hard it tries. None of it matters for soundness.
struct ProjectionEffort {
  RasterKind raster = RasterKind::kDirect;
  int resolution_px = 256;
  int planes_per_face = 6;
  double extent = 1.1;
  double near_m = 0;
  int splits = 3;                 // Rule S: an occludee's box is halved so often in a row
  bool pieces = true;             // convex pieces occlude
  bool surfaces = false;          // whole surfaces occlude too, beside the convex pieces
  std::size_t aimed_planes = 12;  // of a run that aims, over all faces
};

// Threads: one object, one thread.
class ProjectionProver {
 public:
  // Keeps references to both.
  ProjectionProver(const Scene& scene, const OccluderRanking& ranking,
                   const ProjectionEffort& effort);

  // Removes from `open` the objects that no point of the cell can see. `visible` holds `open` and
  // the objects known to be seen: only what it holds is projected. What is removed from `open` is
  // removed from `visible` too.
  // Adds to the statistics what it did; not which objects it settled.
  // `evidence`, if any, is filled in where its object is in `open`, but for the method.
  void run(const Cell& cell, VisibleSet& visible, VisibleSet& open, CellStatistics& statistics,
           Evidence* evidence = nullptr);
  // The same on planes that are aimed at what is open; `before` were tried already. May find no
  // plane worth while, and then does nothing.
  void run_aimed(const Cell& cell, std::span<const ProjectionPlane> before, VisibleSet& visible,
                 VisibleSet& open, CellStatistics& statistics, Evidence* evidence = nullptr);

  // The maps of the last run, as they were at its end.
  std::span<const OcclusionMap> maps() const { return std::span(maps_).first(map_count_); }
  // To be drawn on by others, in pixels that keep the promise of the map.
  std::span<OcclusionMap> maps() { return std::span(maps_).first(map_count_); }

 private:
  double ground_depth(const CellFrame& frame, const Cell& cell) const;
  void rank(const CellFrame& frame, const VisibleSet& visible, CellStatistics& statistics);
  void note(const VisibleSet& tested, Evidence* evidence) const;
  void add_occluders(const CellFrame& frame, double ground_depth, const VisibleSet& visible,
                     std::size_t from, std::size_t end, CellStatistics& statistics);
  void begin_maps(std::span<const ProjectionPlane> planes, CellStatistics& statistics);
  void project_from(const CellFrame& frame, std::size_t from, CellStatistics& statistics);
  void draw_surfaces(const Cell& cell, const CellFrame& frame, const VisibleSet& open,
                     CellStatistics& statistics);

  const Scene& scene_;
  const OccluderRanking& ranking_;
  ProjectionEffort effort_;
  std::unique_ptr<Rasteriser> rasteriser_;
  // Kept from cell to cell so that nothing is allocated once warm.
  std::vector<RankedOccluder> ranked_;
  LocalOccluders occluders_;
  OccluderScreen screen_;  // of occluders_
  std::vector<OcclusionMap> maps_;
  std::size_t map_count_ = 0;
  CoverageList coverages_;
  SurfaceChainBuilder chain_builder_;
  SurfaceChain chain_;
  SurfaceCover cover_;
};

}  // namespace pvsfarm

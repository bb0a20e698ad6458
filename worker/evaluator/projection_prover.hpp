// A prover of the cascade: extended Projections on planes around the cell.
//
// Source: Durand 2000, with the corrections of docs/algorithm.md.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "common/cells/cell.hpp"
#include "common/pvs/delta.hpp"
#include "common/pvs/settings.hpp"
#include "worker/evaluator/occludee_hierarchy.hpp"
#include "worker/evaluator/wanted_tiles.hpp"
#include "worker/visibility/occluder_ranking.hpp"
#include "worker/visibility/occluder_screen.hpp"
#include "worker/visibility/rasteriser.hpp"
#include "worker/visibility/stages.hpp"
#include "worker/visibility/surface_chain.hpp"
#include "worker/visibility/surface_cover.hpp"

namespace pvsfarm {

// How hard it tries. None of it matters for soundness.
struct ProjectionEffort {
  RasterKind raster = RasterKind::kDirect;
  int resolution_px = 256;
  int first_resolution_px = 256;  // the same, of the first planes
  int planes_per_face = 6;
  double extent = 1.3;
  double near_m = 0;
  int splits = 3;                 // Rule S: an occludee's box is halved so often in a row
  int refined_splits = 6;         // the same, of a refinement
  bool improved = false;          // parts are tested by the improved Projection too
  bool pieces = true;             // convex pieces occlude
  bool surfaces = false;          // whole surfaces occlude too, beside the convex pieces
  std::size_t aimed_planes = 12;  // of a refinement, over all faces
};

// Threads: one object, one thread.
class ProjectionProver {
 public:
  // Keeps references to both.
  ProjectionProver(const Scene& scene, const OccluderRanking& ranking,
                   const ProjectionEffort& effort, CpuClock clock = nullptr);

  // Removes from `open` the objects that no point of the cell can see. `visible` holds `open` and
  // the objects known to be seen: only what it holds is projected. What is removed from `open` is
  // removed from `visible` too.
  // Adds to the statistics what it did; not which objects it settled.
  // `evidence`, if any, is filled in where its object is in `open`, but for the method.
  //
  // First the largest occluders against whole objects: all that is far off goes, at little cost.
  void run(const Cell& cell, VisibleSet& visible, VisibleSet& open, CellStatistics& statistics,
           Evidence* evidence = nullptr);
  // After `run`, for the same cell, with the same sets or less since: the other occluders, but for
  // those hidden by now, on the same maps, and what is still open by parts. It costs more an
  // object: whatever is seen meanwhile is saved.
  void finish(const Cell& cell, VisibleSet& visible, VisibleSet& open, CellStatistics& statistics,
              Evidence* evidence = nullptr);
  // Goes on where `finish` or the last refinement for this cell ended, in the same way: the
  // occluders that are not hidden by now, on planes that are aimed at what is open. May find no
  // plane worth while, and then does nothing.
  void refine(const Cell& cell, VisibleSet& visible, VisibleSet& open, CellStatistics& statistics,
              Evidence* evidence = nullptr);

  // From now on `stages` is told where time goes; null: nobody is.
  void profile(Stages* stages) { stages_ = stages; }

  // How parts are tested.
  BoxRule by_parts() const { return effort_.improved ? BoxRule::kImproved : BoxRule::kPlain; }
  // What the last run, its end or refinement owes to the improved Projection alone.
  std::span<const ObjectId> improved_objects() const { return improved_objects_; }
  std::uint32_t improved_tests() const { return improved_tests_; }
  double improved_ms() const { return improved_ms_; }  // of the clock, if there is one
  // What it worked on then.
  MapsUsed maps_used() const;

  // The maps of the last run or refinement, as they were at its end.
  std::span<const OcclusionMap> maps() const {
    return std::span(maps_of_[aimed_]).first(map_count_);
  }
  // To be drawn on by others, in pixels that keep the promise of the map.
  std::span<OcclusionMap> maps() { return std::span(maps_of_[aimed_]).first(map_count_); }

 private:
  double ground_depth(const CellFrame& frame, const Cell& cell) const;
  void rank(const CellFrame& frame, const VisibleSet& visible, CellStatistics& statistics);
  HierarchyTest test_on(const CellFrame& frame, BoxRule rule, Evidence* evidence) const;
  void test(HierarchyTest& test, VisibleSet& open, int splits) const;
  void book(const HierarchyTest& test, VisibleSet hidden, const VisibleSet& open,
            VisibleSet& visible, CellStatistics& statistics);
  void note(const VisibleSet& tested, Evidence* evidence) const;
  void add_occluders(const CellFrame& frame, std::size_t from, std::size_t end);
  void keep_visible(const VisibleSet& visible, CellStatistics& statistics);
  void drop_hidden(const VisibleSet& visible, CellStatistics& statistics);
  void begin_maps(std::vector<ProjectionPlane> planes, CellStatistics& statistics);
  bool draw_from(const CellFrame& frame, std::size_t from, OcclusionMap& map,
                 CellStatistics& statistics);
  void find_wanted(const CellFrame& frame, const VisibleSet& open);
  void project_from(const CellFrame& frame, std::size_t from, const WantedTiles* wanted,
                    CellStatistics& statistics);
  void draw_surfaces(const Cell& cell, const CellFrame& frame, const VisibleSet& open,
                     CellStatistics& statistics);

  const Scene& scene_;
  const OccluderRanking& ranking_;
  ProjectionEffort effort_;
  CpuClock clock_;
  Stages* stages_ = nullptr;
  std::unique_ptr<Rasteriser> rasteriser_;
  // Kept from cell to cell so that nothing is allocated once warm.
  std::vector<RankedOccluder> ranked_;
  LocalOccluders occluders_;
  OccluderScreen screen_;  // of occluders_
  double ground_depth_ = 0;
  std::array<std::vector<OcclusionMap>, 2> maps_of_;  // the first planes, the aimed ones
  std::size_t aimed_ = 0;                             // those drawn on last
  std::size_t map_count_ = 0;
  std::vector<ProjectionPlane> planes_;  // of the maps
  std::vector<ProjectionPlane> tried_;   // of all maps of this cell
  std::vector<ObjectId> improved_objects_;
  std::uint32_t improved_tests_ = 0;
  double improved_ms_ = 0;
  WantedTiles wanted_;
  CoverageList coverages_;
  SurfaceChainBuilder chain_builder_;
  SurfaceChain chain_;
  SurfaceCover cover_;
};

}  // namespace pvsfarm

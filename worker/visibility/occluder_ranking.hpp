// Which occluders are worth projecting from a cell, largest first.
//
// Source: Durand 2000, 5.1 (solid angle); theory A.13. Any choice is sound.
#pragma once

#include "common/pvs/visible_set.hpp"
#include "worker/visibility/occluder_pieces.hpp"

namespace pvsfarm {

struct RankingRequest {
  double near_m = 0;
  double ground_depth = 0;       // see add_local
  double least_solid_angle = 0;  // [sr] smaller ones cannot cover a pixel
};

// Every occluder that is legal for the cell, large enough, and owned by an object of `candidates`
// or by one that only occludes; by falling solid angle, ties in scene order.
void rank_occluders(const Scene& scene, const CellFrame& frame, const VisibleSet& candidates,
                    const RankingRequest& request, LocalOccluders& out);

// Whether an object that may still be visible, or one that only occludes, owns the occluder.
bool owner_in(const Scene& scene, const Occluder& occluder, const VisibleSet& candidates);

}  // namespace pvsfarm

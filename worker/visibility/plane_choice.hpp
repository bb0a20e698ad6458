// Where to put projection planes.
//
// Source: Durand 2000, 6.1; theory A.13. Any place is sound. A Projection loses least on a plane
// near its occluder, and blockers stand at all distances: so the first plane goes where the nearest
// large occluders end, the last one well into the scene, the others between in equal ratios.
// Differs from Durand 2000: several planes a face, and rectangles fitted to what lies behind.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "common/pvs/visible_set.hpp"
#include "worker/visibility/occluder_pieces.hpp"

namespace pvsfarm {

// Where the objects lie that may still be hidden, in the local frame.
struct OccludeeExtent {
  Box around;
  Vec3 highest_lo{-std::numeric_limits<double>::infinity()};  // the farthest low side, by axis
  Vec3 lowest_hi{std::numeric_limits<double>::infinity()};
};
OccludeeExtent extent_of(const Scene& scene, const CellFrame& frame, const VisibleSet& open);

struct PlaneRequest {
  int planes_per_face = 6;
  double extent = 1.3;
  int resolution_px = 256;
  OccludeeExtent occludees;
};

// At most planes_per_face planes for each face that has occluders and occludees beyond it, nearest
// first within a face. `occluders` must be ranked.
std::vector<ProjectionPlane> choose_planes(const CellFrame& frame, const LocalOccluders& occluders,
                                           const PlaneRequest& request);

// What planes are aimed at: objects that others have left open.
struct AimRequest {
  std::size_t planes = 12;  // at most so many, over all faces
  double extent = 1.3;
  int resolution_px = 256;
  std::span<const ProjectionPlane> before;  // that the objects were tested on already
};

// Planes where the likely blockers of what is open end: of a sample of the objects, the occluders
// that a line from the cell's centre meets before the object. Picked one by one, each the place
// that is nearest to the ends of most blockers that no plane before it was near to.
std::vector<ProjectionPlane> aim_planes(const Scene& scene, const CellFrame& frame,
                                        const LocalOccluders& occluders, const VisibleSet& open,
                                        const AimRequest& request);

}  // namespace pvsfarm

// The hidden rule for occludees: Rule P (one plane), and its outer-conservative rectangle.
//
// Source: Durand 2000, 2.4 and 3.1; theory A.3, A.8, A.9.
// Differs from Durand 2000: one plane suffices, and only a plane whose rectangle holds the whole
// Projection may answer; clipping the Projection to the rectangle is unsound (finite_rect_leak).
#pragma once

#include "worker/visibility/occlusion_map.hpp"

namespace pvsfarm {

// The union of the views of `box` (plane frame) from the cell, as a rectangle, widened by rounding.
// Requires: box.lo.z > -D.
PlaneRect occludee_rect(const ProjectionPlane& plane, const Box& box);

enum class PlaneAnswer {
  kHidden,   // certified: every ray from the cell to the box is blocked before it
  kUnknown,  // this plane does not tell, but it might for a part of the box
  kFutile,   // this plane can hide no part of the box either
};

// Rule P for one local box on one plane. kFutile is exact for sub-boxes (theory A.9).
PlaneAnswer test_box(const OcclusionMap& map, const Box& local_box);

// The depths of a box, rounded outwards.
struct BoxDepths {
  float nearest;
  double deepest;
};
// Its last step: a box whose rectangle touches `range` (as OcclusionMap::touched says) and holds
// its whole Projection.
PlaneAnswer answer_on(const OcclusionMap& map, const PixelRange& range, const BoxDepths& depths);

}  // namespace pvsfarm

#include "worker/evaluator/projection_efforts.hpp"

#include <algorithm>

namespace pvsfarm {
namespace {

// Of the first planes, whose maps need be half as fine: what they leave goes to others.
constexpr int kCoarser = 2, kLeastPx = 64;
// Planes of a round of escalation, over all faces, more than a face has at first.
constexpr int kMoreAimed = 2;

}  // namespace

ProjectionEffort effort_of(const EvaluatorSettings& s) {
  return {.raster = s.raster,
          .resolution_px = s.resolution_px,
          .first_resolution_px = s.raster == RasterKind::kDirect
                                     ? std::max(s.resolution_px / kCoarser, kLeastPx)
                                     : s.resolution_px,  // OpenGL draws on one size
          .planes_per_face = s.planes_per_face,
          .extent = s.extent,
          .near_m = s.near_m,
          .splits = s.methods.has(Method::kProjection) ? kSplits : kFineSplits,
          .refined_splits = kFineSplits,
          .improved = s.methods.has(Method::kImproved),
          .aimed_planes = static_cast<std::size_t>(s.planes_per_face) + kMoreAimed};
}

// Surfaces have no seams to lose pixels at: coarser maps and the first planes do, and cost a
// fourth.
ProjectionEffort with_surfaces(ProjectionEffort effort) {
  effort.surfaces = true;
  effort.raster = RasterKind::kDirect;  // surfaces are not drawn by OpenGL
  effort.splits = kFineSplits;
  effort.resolution_px = effort.first_resolution_px =
      std::max(effort.resolution_px / kCoarser, kLeastPx);
  return effort;
}

// Maps for slices to be drawn on, where no others are.
ProjectionEffort bare(ProjectionEffort effort) {
  effort.pieces = false;
  effort.first_resolution_px = effort.resolution_px;
  effort.splits = 0;
  return effort;
}

}  // namespace pvsfarm

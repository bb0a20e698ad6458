#include "worker/evaluator/projection_efforts.hpp"

#include <algorithm>

namespace pvsfarm {
namespace {

// Planes of a round of escalation, over all faces, as a multiple of those a face has at first. Maps
// twice as fine as well would settle half as much again, in twice the time.
constexpr int kAimedFactor = 2;

}  // namespace

ProjectionEffort effort_of(const EvaluatorSettings& s) {
  return {.raster = s.raster,
          .resolution_px = s.resolution_px,
          .planes_per_face = s.planes_per_face,
          .extent = s.extent,
          .near_m = s.near_m,
          .splits = s.methods.has(Method::kProjection) ? kSplits : kFineSplits,
          .refined_splits = kFineSplits,
          .aimed_planes = static_cast<std::size_t>(kAimedFactor) * s.planes_per_face};
}

// Surfaces have no seams to lose pixels at: coarser maps and the first planes do, and cost a
// fourth.
ProjectionEffort with_surfaces(ProjectionEffort effort) {
  effort.surfaces = true;
  effort.raster = RasterKind::kDirect;  // surfaces are not drawn by OpenGL
  effort.splits = kFineSplits;
  effort.resolution_px = std::max(effort.resolution_px / 2, 64);
  return effort;
}

// Maps for slices to be drawn on, where no others are.
ProjectionEffort bare(ProjectionEffort effort) {
  effort.pieces = false;
  effort.splits = 0;
  return effort;
}

}  // namespace pvsfarm

// Re-projection: what an occlusion map certifies about a plane farther out.
//
// Source: Durand 2000, 5; theory B.1. A ray from the cell to a pixel of the farther plane crosses
// the nearer one within the pixel's footprint. If every pixel that the footprint touches is
// covered, the ray is blocked no deeper than the deepest of them: a ray certificate, wherever the
// occluders stand.
// Differs from Durand 2000: a gather over footprints for the cell itself, not a convolution for an
// equivalent one, and depths are kept. Reset to the first plane's they are wrong for whatever lies
// behind it (adversarial case reproj_reset_depth).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "worker/visibility/occlusion_map.hpp"

namespace pvsfarm {

// Pixels first .. last of one axis of a map; last < first: a footprint that leaves the map.
struct PixelSpan {
  std::int32_t first = 0, last = -1;
  bool valid() const { return first <= last; }
  std::int32_t size() const { return last - first + 1; }
};

enum class MapAxis { kX, kY };

// For every column or row of `to`, the columns or rows of `from` that rays from the cell to it may
// cross, widened by rounding. Both ends grow with the pixel.
// Requires: planes of one face of one cell, `to` the farther.
void footprints(const ProjectionPlane& from, const ProjectionPlane& to, MapAxis axis,
                std::vector<PixelSpan>& out);

// Threads: one object, one thread. Allocates nothing once warm.
class Reprojection {
 public:
  // Lowers every pixel of `to` to what `from` certifies for it; leaves it alone where the footprint
  // leaves `from` or any pixel of it is uncovered. The pyramids of `to` have to be built anew.
  // Requires: planes of one face of one cell, `to` the farther.
  void gather(const OcclusionMap& from, OcclusionMap& to);

 private:
  std::vector<PixelSpan> columns_, rows_;
  std::vector<float> rising_, row_;
};

}  // namespace pvsfarm

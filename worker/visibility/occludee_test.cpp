#include "worker/visibility/occludee_test.hpp"

#include <algorithm>
#include <cmath>

#include "common/geometry/rounding.hpp"

namespace pvsfarm {
namespace {

// One axis: x' = M alpha + V (1 - alpha), extreme over V in [-h, h], M in [lo, hi] and the four
// alphas, which are extreme at the ends of the depths of cell and box.
void extremes(double lo, double hi, double h, const double (&alpha)[4], double& out_lo,
              double& out_hi) {
  out_lo = HUGE_VAL;
  out_hi = -HUGE_VAL;
  for (const double a : alpha) {
    const double reach = h * std::abs(1 - a);
    out_lo = std::min(out_lo, lo * a - reach);
    out_hi = std::max(out_hi, hi * a + reach);
  }
}

}  // namespace

PlaneRect occludee_rect(const ProjectionPlane& plane, const Box& box) {
  const double front = plane.distance, back = plane.distance + 2 * plane.hw;
  const double alpha[4] = {front / (box.lo.z + front), front / (box.hi.z + front),
                           back / (box.lo.z + back), back / (box.hi.z + back)};
  PlaneRect r;
  extremes(box.lo.x, box.hi.x, plane.hu, alpha, r.x0, r.x1);
  extremes(box.lo.y, box.hi.y, plane.hv, alpha, r.y0, r.y1);
  // alpha's own rounding is relative to |z| + back over the distance to the face: widen by it.
  const double gap = box.lo.z + front;
  const double amplify = 1 + (std::abs(box.lo.z) + std::abs(box.hi.z) + back) / gap;
  const double wide = 0x1p-48 * amplify;
  const double wx = wide * (std::abs(r.x0) + std::abs(r.x1) + plane.hu) + 1e-9 * plane.px;
  const double wy = wide * (std::abs(r.y0) + std::abs(r.y1) + plane.hv) + 1e-9 * plane.py;
  return {r.x0 - wx, r.y0 - wy, r.x1 + wx, r.y1 + wy};
}

PlaneAnswer test_box(const OcclusionMap& map, const Box& local_box) {
  const ProjectionPlane& plane = map.plane();
  const Box box = plane.plane_from_local(local_box);
  const double rounding =
      0x1p-48 * (std::abs(box.lo.z) + std::abs(box.hi.z) + plane.distance + 2 * plane.hw);
  if (!(box.hi.z + plane.distance > rounding)) return PlaneAnswer::kFutile;
  const double deepest = box.hi.z + rounding;
  if (!(map.lowest() < deepest)) return PlaneAnswer::kFutile;
  // (i) strictly beyond the face; a part of a box that crosses it may be anywhere on the map.
  if (!(box.lo.z + plane.distance > rounding)) return PlaneAnswer::kUnknown;
  const PlaneRect rect = occludee_rect(plane, box);
  if (!(rect.x0 <= rect.x1 && rect.y0 <= rect.y1)) return PlaneAnswer::kUnknown;  // NaN
  return answer_on(map, map.touched(rect),
                   {.nearest = float_not_above(box.lo.z - rounding), .deepest = deepest});
}

PlaneAnswer answer_on(const OcclusionMap& map, const PixelRange& range, const BoxDepths& depths) {
  // Cheapest first: what no pixel can hide, not all of them do.
  if (!(map.lower_bound(range) < depths.deepest)) return PlaneAnswer::kFutile;
  // (ii) and (iii); NaN compares false and means visible.
  return map.covered(range, depths.nearest) ? PlaneAnswer::kHidden : PlaneAnswer::kUnknown;
}

}  // namespace pvsfarm

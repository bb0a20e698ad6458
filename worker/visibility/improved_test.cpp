#include "worker/visibility/improved_test.hpp"

#include <algorithm>
#include <cmath>

#include "common/geometry/rounding.hpp"
#include "worker/visibility/occludee_test.hpp"

namespace pvsfarm {
namespace {

// On one axis: an interval that has to be covered wholly, or points of which any one will do.
struct Stab {
  double lo, hi;
  bool any;
};

// The view of a point x at depth z from the front face is [x a - h (a - 1), x a + h (a - 1)], with
// a = D / (z + D) >= 1. An interval from the least upper end to the greatest lower end meets all
// views; so does each of their common points. Ends are moved by `error` so that either still holds.
Stab stab(double lo, double hi, double h, const double (&alpha)[2], double error, double margin) {
  double least_hi = HUGE_VAL, most_lo = -HUGE_VAL;
  for (const double x : {lo, hi})
    for (const double a : alpha) {
      least_hi = std::min(least_hi, x * a + h * (a - 1) - error);
      most_lo = std::max(most_lo, x * a - h * (a - 1) + error);
    }
  if (most_lo + margin < least_hi - margin) return {most_lo + margin, least_hi - margin, true};
  return {std::min(least_hi, most_lo) - margin, std::max(least_hi, most_lo) + margin, false};
}

// The first column of [i0, i1] whose pixels of rows j0 .. j1 are all nearer than depth; -1: none.
// `step`, `row`: from pixel to pixel along and across, so that rows are searched alike.
int find_line(const float* base, std::ptrdiff_t step, std::ptrdiff_t row, int i0, int i1, int j0,
              int j1, float depth) {
  int failing = j0;  // where one column fails the next is likely to
  for (int i = i0; i <= i1; ++i) {
    const float* column = base + i * step;
    if (!(column[failing * row] < depth)) continue;
    int j = j0;
    while (j <= j1 && column[j * row] < depth) ++j;
    if (j > j1) return i;
    failing = j;
  }
  return -1;
}

// A rectangle within the pixels [i0, i1] x [j0, j1].
PlaneRect middle_of(const ProjectionPlane& plane, int i0, int j0, int i1, int j1) {
  return {plane.x0 + (i0 + 0.5) * plane.px, plane.y0 + (j0 + 0.5) * plane.py,
          plane.x0 + (i1 + 0.5) * plane.px, plane.y0 + (j1 + 0.5) * plane.py};
}

// Pixels that all have Z < depth and that hold, together, an x of `x` and a y of `y`, or all of
// them. None: there are none, or NaN.
std::optional<PlaneRect> find_covered(const OcclusionMap& map, const Stab& x, const Stab& y,
                                      float depth) {
  const PlaneRect rect{x.lo, y.lo, x.hi, y.hi};
  if (!(rect.x0 <= rect.x1 && rect.y0 <= rect.y1)) return std::nullopt;
  if (!x.any && !y.any) {
    if (!map.covered(rect, depth)) return std::nullopt;
    return rect;
  }
  if (!(map.lower_bound(rect) < depth)) return std::nullopt;
  const ProjectionPlane& plane = map.plane();
  const int side = plane.resolution_px, last = side - 1;
  PixelRange r = map.touched(rect);
  if (x.any) r = {std::max(r.i0, 0), r.j0, std::min(r.i1, last), r.j1};
  if (y.any) r = {r.i0, std::max(r.j0, 0), r.i1, std::min(r.j1, last)};
  if (r.i0 < 0 || r.j0 < 0 || r.i1 > last || r.j1 > last) return std::nullopt;
  const float* base = map.base();
  if (x.any && y.any) {
    for (int j = r.j0; j <= r.j1; ++j) {
      const int i = find_line(base, 1, side, r.i0, r.i1, j, j, depth);
      if (i >= 0) return middle_of(plane, i, j, i, j);
    }
    return std::nullopt;
  }
  if (x.any) {
    const int i = find_line(base, 1, side, r.i0, r.i1, r.j0, r.j1, depth);
    if (i < 0) return std::nullopt;
    return middle_of(plane, i, r.j0, i, r.j1);
  }
  const int j = find_line(base, side, 1, r.j0, r.j1, r.i0, r.i1, depth);
  if (j < 0) return std::nullopt;
  return middle_of(plane, r.i0, j, r.i1, j);
}

}  // namespace

std::optional<PlaneRect> improved_test(const OcclusionMap& map, const Box& local_box) {
  const ProjectionPlane& plane = map.plane();
  Box box = plane.plane_from_local(local_box);
  const double rounding =
      0x1p-48 * (std::abs(box.lo.z) + std::abs(box.hi.z) + plane.distance + 2 * plane.hw);
  // From here on the box is larger than the true one by what rounding can have done to its depths.
  box.lo.z -= rounding;
  box.hi.z += rounding;
  const double gap = box.lo.z + plane.distance;
  if (!(gap > rounding) || !(box.lo.z < 0)) return std::nullopt;

  // 1. The part before the plane.
  Box before = box;
  before.hi.z = std::min(before.hi.z, 0.0);
  const double front = plane.distance;
  const double alpha[2] = {front / gap, front / (before.hi.z + front)};
  const double amplify = 1 + (std::abs(box.lo.z) + std::abs(box.hi.z) + front) / gap;
  const auto stab_on = [&](int axis, double half, double pixel) {
    const double size = std::max(std::abs(box.lo[axis]), std::abs(box.hi[axis])) + half;
    return stab(box.lo[axis], box.hi[axis], half, alpha, 0x1p-46 * amplify * amplify * size,
                1e-9 * pixel);
  };
  const auto rect = find_covered(map, stab_on(0, plane.hu, plane.px),
                                 stab_on(1, plane.hv, plane.py), float_not_above(before.lo.z));
  if (!rect) return std::nullopt;
  if (!(box.hi.z > 0)) return rect;

  // 2. The part behind it.
  Box behind = box;
  behind.lo.z = 0;
  if (!map.covered(occludee_rect(plane, behind), 0.0f)) return std::nullopt;
  return rect;
}

}  // namespace pvsfarm

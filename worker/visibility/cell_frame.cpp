#include "worker/visibility/cell_frame.hpp"

#include <cmath>
#include <utility>

namespace pvsfarm {
namespace {
constexpr double kRounding =
    0x1p-49;  // 16 units of rounding: dominates three products and two sums
}

Cell right_handed(Cell cell) {
  if (dot(cross(cell.axes[0], cell.axes[1]), cell.axes[2]) < 0) {
    cell.axes[0] = -cell.axes[0];
    cell.lo[0] = -std::exchange(cell.hi[0], -cell.lo[0]);
  }
  return cell;
}

CellFrame::CellFrame(const Cell& given) {
  const Cell cell = right_handed(given);
  origin_ = cell.origin;
  middle_ = cell.lo * 0.5 + cell.hi * 0.5;
  axes_ = cell.axes;
  aligned_ = cell.axes == Cell{}.axes;
  world_bounds_ = given.bounds();
  Vec3 extent;
  for (int a = 0; a < 3; ++a)
    extent[a] = std::max(cell.hi[a] - middle_[a], middle_[a] - cell.lo[a]);
  // The map takes the cell's points sum t_b axes_b to sum t_b (axes_a . axes_b).
  for (int a = 0; a < 3; ++a) {
    half_[a] = 0;
    for (int b = 0; b < 3; ++b) {
      const double skew = dot(axes_[a], axes_[b]) - (a == b ? 1.0 : 0.0);
      half_[a] += (a == b ? extent[b] : 0) +
                  std::abs(skew) * (extent[b] + std::abs(middle_[b])) * (aligned_ ? 0.0 : 1.0);
    }
    half_[a] += kRounding * (extent[a] + (aligned_ ? 0.0 : std::abs(middle_[a])));
  }
}

Box CellFrame::local_around_world(const Box& box) const {
  if (aligned_) {
    const Vec3 lo = box.lo - origin_ - middle_, hi = box.hi - origin_ - middle_;
    const Vec3 wide = (glm::abs(lo) + glm::abs(hi)) * kRounding;
    return {lo - wide, hi + wide};
  }
  // Relative to the cell before anything else: far from the world's origin the middle of two
  // coordinates is off by more than a small box is wide.
  const Vec3 lo = box.lo - origin_, hi = box.hi - origin_;
  const Vec3 middle = lo * 0.5 + hi * 0.5, half = hi * 0.5 - lo * 0.5;
  Box out;
  for (int a = 0; a < 3; ++a) {
    const double center = dot(axes_[a], middle) - middle_[a];
    double reach = std::abs(axes_[a].x) * half.x + std::abs(axes_[a].y) * half.y +
                   std::abs(axes_[a].z) * half.z;
    reach += kRounding * (reach + length(lo) + length(hi) + length(middle_));
    out.lo[a] = center - reach;
    out.hi[a] = center + reach;
  }
  return out;
}

Box CellFrame::local_around_point(const Vec3& p) const {
  const Vec3 local = local_from_world(p);
  const Vec3 wide(kRounding * (length(p - origin_) + length(middle_) + length(local)));
  return {local - wide, local + wide};
}

ProjectionPlane square_plane(const CellFrame& frame, Face face, double distance, double extent,
                             int resolution_px) {
  ProjectionPlane plane;
  plane.face = face;
  plane.distance = distance;
  plane.hu = frame.half()[face.u()];
  plane.hv = frame.half()[face.v()];
  plane.hw = frame.half()[face.axis];
  plane.resolution_px = resolution_px;
  plane.x0 = -extent * (plane.hu + distance);
  plane.y0 = -extent * (plane.hv + distance);
  plane.px = -2 * plane.x0 / resolution_px;
  plane.py = -2 * plane.y0 / resolution_px;
  return plane;
}

}  // namespace pvsfarm

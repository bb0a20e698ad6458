#include "worker/visibility/box_on_planes.hpp"

#include <algorithm>
#include <cmath>

#include "common/geometry/rounding.hpp"
#include "worker/visibility/dispatch.hpp"

namespace pvsfarm {
namespace {

constexpr double kFutile = 0, kCrosses = 1, kFalls = 2;
constexpr int kLanes = 8;

// The box in the frame of a face: z from the face on.
struct FaceBox {
  double x0, x1, y0, y1, z0, z1, hu, hv, hw;
};

struct Range {
  double lo, hi;
};

// occludee_test.cpp, `extremes`, written for the vectoriser.
inline Range extremes(double lo, double hi, double h, double a, double b, double c, double d) {
  const double ra = h * std::abs(1 - a), rb = h * std::abs(1 - b), rc = h * std::abs(1 - c),
               rd = h * std::abs(1 - d);
  double least = lo * a - ra, most = hi * a + ra;
  const double least_b = lo * b - rb, most_b = hi * b + rb;
  const double least_c = lo * c - rc, most_c = hi * c + rc;
  const double least_d = lo * d - rd, most_d = hi * d + rd;
  least = least_b < least ? least_b : least;
  least = least_c < least ? least_c : least;
  least = least_d < least ? least_d : least;
  most = most_b > most ? most_b : most;
  most = most_c > most ? most_c : most;
  most = most_d > most ? most_d : most;
  return {least, most};
}

// As OcclusionMap::touched, but for the rounding towards zero.
inline double pixel(double at, double from, double per_px, double side) {
  const double pixels = (at - from) * per_px;
  const double most = pixels < side ? pixels : side;
  return pixels < 0 ? -1 : most;
}

PVSFARM_DISPATCH
void place_box(const BoxOnPlanes::Columns& c, int lanes, const FaceBox& box,
               BoxOnPlanes::Places& out) {
  for (int k = 0; k < lanes; ++k) {
    const double front = c.distance[k], back = c.back[k];
    const double lo_z = box.z0 - front, hi_z = box.z1 - front;
    const double rounding = 0x1p-48 * (std::abs(lo_z) + std::abs(hi_z) + front + 2 * box.hw);
    const double gap = lo_z + front;
    const double a = front / gap, b = front / (hi_z + front);
    const double d = back / (lo_z + back), e = back / (hi_z + back);
    const Range x = extremes(box.x0, box.x1, box.hu, a, b, d, e);
    const Range y = extremes(box.y0, box.y1, box.hv, a, b, d, e);
    const double wide = 0x1p-48 * (1 + (std::abs(lo_z) + std::abs(hi_z) + back) / gap);
    const double wx = wide * (std::abs(x.lo) + std::abs(x.hi) + box.hu) + 1e-9 * c.px[k];
    const double wy = wide * (std::abs(y.lo) + std::abs(y.hi) + box.hv) + 1e-9 * c.py[k];
    out.i0[k] = pixel(x.lo - wx, c.x0[k], c.per_px[k], c.side[k]);
    out.i1[k] = pixel(x.hi + wx, c.x0[k], c.per_px[k], c.side[k]);
    out.j0[k] = pixel(y.lo - wy, c.y0[k], c.per_py[k], c.side[k]);
    out.j1[k] = pixel(y.hi + wy, c.y0[k], c.per_py[k], c.side[k]);
    out.nearest[k] = lo_z - rounding;
    out.deepest[k] = hi_z + rounding;
    const bool sane = (x.lo - wx <= x.hi + wx) & (y.lo - wy <= y.hi + wy);  // no NaN
    const bool falls = (gap > rounding) & sane;
    // A float is below a number rounded up to a float exactly if it is below the number.
    const bool useful = (hi_z + front > rounding) & (c.lowest[k] < hi_z + rounding);
    const double where = falls ? kFalls : kCrosses;
    out.where[k] = useful ? where : kFutile;
  }
}

}  // namespace

template <class PlaneOf>
std::size_t BoxOnPlanes::set_columns(std::size_t most, PlaneOf&& plane_of) {
  first_ = plane_of(0);
  const auto same_face = [&](const ProjectionPlane& plane) {
    return plane.face.axis == first_.face.axis && plane.face.sign == first_.face.sign &&
           plane.hu == first_.hu && plane.hv == first_.hv && plane.hw == first_.hw;
  };
  std::size_t count = 0;
  while (count < most && count < kMaxPlanesAtOnce && same_face(plane_of(count))) ++count;
  lanes_ = (static_cast<int>(count) + kLanes - 1) / kLanes * kLanes;
  for (int k = 0; k < lanes_; ++k) {
    const ProjectionPlane& plane = plane_of(std::min<std::size_t>(k, count - 1));
    columns_.distance[k] = plane.distance;
    columns_.back[k] = plane.distance + 2 * plane.hw;
    columns_.x0[k] = plane.x0;
    columns_.y0[k] = plane.y0;
    columns_.px[k] = plane.px;
    columns_.py[k] = plane.py;
    columns_.per_px[k] = 1 / plane.px;
    columns_.per_py[k] = 1 / plane.py;
    columns_.side[k] = plane.resolution_px;
    columns_.lowest[k] = -kUncovered;
  }
  return count;
}

std::size_t BoxOnPlanes::set(std::span<const OcclusionMap> maps) {
  const std::size_t count = set_columns(
      maps.size(), [&](std::size_t k) -> const ProjectionPlane& { return maps[k].plane(); });
  maps_ = maps.first(count);
  for (int k = 0; k < lanes_; ++k)
    columns_.lowest[k] = maps[std::min<std::size_t>(k, count - 1)].lowest();
  return count;
}

std::size_t BoxOnPlanes::set(std::span<const ProjectionPlane> planes) {
  maps_ = {};
  return set_columns(planes.size(),
                     [&](std::size_t k) -> const ProjectionPlane& { return planes[k]; });
}

void BoxOnPlanes::place(const Box& local_box) {
  const ProjectionPlane& plane = first_;
  const Face face = plane.face;
  const double a = face.sign * local_box.lo[face.axis], b = face.sign * local_box.hi[face.axis];
  place_box(columns_, lanes_,
            {local_box.lo[face.u()], local_box.hi[face.u()], local_box.lo[face.v()],
             local_box.hi[face.v()], std::min(a, b) - plane.hw, std::max(a, b) - plane.hw, plane.hu,
             plane.hv, plane.hw},
            places_);
}

std::optional<PixelRange> BoxOnPlanes::pixels(std::size_t k) const {
  if (places_.where[k] != kFalls) return {};
  const int last = static_cast<int>(columns_.side[k]) - 1;
  const PixelRange range{std::max(static_cast<int>(places_.i0[k]), 0),
                         std::max(static_cast<int>(places_.j0[k]), 0),
                         std::min(static_cast<int>(places_.i1[k]), last),
                         std::min(static_cast<int>(places_.j1[k]), last)};
  if (range.i0 > range.i1 || range.j0 > range.j1) return {};
  return range;
}

PlaneAnswer BoxOnPlanes::answer(std::size_t k) const {
  if (places_.where[k] == kFutile) return PlaneAnswer::kFutile;
  if (places_.where[k] == kCrosses) return PlaneAnswer::kUnknown;
  const PixelRange range{static_cast<int>(places_.i0[k]), static_cast<int>(places_.j0[k]),
                         static_cast<int>(places_.i1[k]), static_cast<int>(places_.j1[k])};
  return answer_on(maps_[k], range, places_.nearest[k], places_.deepest[k]);
}

}  // namespace pvsfarm

#include "worker/visibility/box_on_planes.hpp"

#include <algorithm>

#include "worker/visibility/dispatch.hpp"
#include "worker/visibility/lanes.hpp"

namespace pvsfarm {
namespace {

constexpr int kLanes = 8;

// The box in the frame of a face: z from the face on.
struct FaceBox {
  double x0, x1, y0, y1, z0, z1, hu, hv, hw;
};

struct Range {
  Eight lo, hi;
};

// occludee_test.cpp, `extremes`.
PVSFARM_INLINE Range extremes(double lo, double hi, double h, const Eight (&alpha)[4]) {
  Range range;
  for (int i = 0; i < 4; ++i) {
    const Eight reach = h * magnitude(1 - alpha[i]);
    const Eight least = lo * alpha[i] - reach, most = hi * alpha[i] + reach;
    range.lo = i == 0 ? least : smaller(least, range.lo);
    range.hi = i == 0 ? most : larger(most, range.hi);
  }
  return range;
}

// As OcclusionMap::touched.
PVSFARM_INLINE EightInts pixel(const Eight& at, const Eight& from, const Eight& per_px,
                               const Eight& side) {
  const Eight pixels = (at - from) * per_px;
  const Eight kept = pixels < 0 ? all_lanes(-1) : smaller(pixels, side);
  return __builtin_convertvector(kept, EightInts);
}

// float_not_above: where rounding went up, the next float down.
PVSFARM_INLINE EightFloats floats_not_above(const Eight& v) {
  const EightFloats nearest = __builtin_convertvector(v, EightFloats);
  const Eight up = __builtin_convertvector(nearest, Eight) > v ? all_lanes(1) : all_lanes(0);
  const EightInts step = nearest > 0 ? EightInts{} - 1 : EightInts{} + 1;
  const EightInts bits =
      load_lanes<EightInts>(&nearest) + step * __builtin_convertvector(up, EightInts);
  return load_lanes<EightFloats>(&bits);
}

// A bit a lane.
struct Told {
  unsigned futile, falls;
};

PVSFARM_DISPATCH
Told place_box(const BoxOnPlanes::Columns& c, int at, const FaceBox& box,
               BoxOnPlanes::Places& out) {
  const auto column = [at](const double* values) { return load_lanes<Eight>(values + at); };
  const Eight front = column(c.distance), back = column(c.back);
  const Eight lo_z = box.z0 - front, hi_z = box.z1 - front;
  const Eight rounding = 0x1p-48 * (magnitude(lo_z) + magnitude(hi_z) + front + 2 * box.hw);
  const Eight gap = lo_z + front;
  const Eight alpha[4] = {front / gap, front / (hi_z + front), back / (lo_z + back),
                          back / (hi_z + back)};
  const Range x = extremes(box.x0, box.x1, box.hu, alpha);
  const Range y = extremes(box.y0, box.y1, box.hv, alpha);
  const Eight wide = 0x1p-48 * (1 + (magnitude(lo_z) + magnitude(hi_z) + back) / gap);
  const Eight wx = wide * (magnitude(x.lo) + magnitude(x.hi) + box.hu) + 1e-9 * column(c.px);
  const Eight wy = wide * (magnitude(y.lo) + magnitude(y.hi) + box.hv) + 1e-9 * column(c.py);
  const Eight side = column(c.side);
  store_lanes(out.i0 + at, pixel(x.lo - wx, column(c.x0), column(c.per_px), side));
  store_lanes(out.i1 + at, pixel(x.hi + wx, column(c.x0), column(c.per_px), side));
  store_lanes(out.j0 + at, pixel(y.lo - wy, column(c.y0), column(c.per_py), side));
  store_lanes(out.j1 + at, pixel(y.hi + wy, column(c.y0), column(c.per_py), side));
  const Eight nearest = lo_z - rounding, deepest = hi_z + rounding;
  store_lanes(out.nearest + at, nearest);
  store_lanes(out.deepest + at, deepest);
  store_lanes(out.before + at, floats_not_above(nearest));
  // A float is below a number rounded up to a float exactly if it is below the number.
  const unsigned useful =
      bits_of(above(hi_z + front, rounding)) & bits_of(above(deepest, column(c.lowest)));
  const unsigned falls = bits_of(above(gap, rounding)) & bits_of(not_above(x.lo - wx, x.hi + wx)) &
                         bits_of(not_above(y.lo - wy, y.hi + wy));  // no NaN
  return {~useful & 0xff, useful & falls};
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
  const FaceBox box{local_box.lo[face.u()],
                    local_box.hi[face.u()],
                    local_box.lo[face.v()],
                    local_box.hi[face.v()],
                    std::min(a, b) - plane.hw,
                    std::max(a, b) - plane.hw,
                    plane.hu,
                    plane.hv,
                    plane.hw};
  futile_ = falls_ = 0;
  for (int at = 0; at < lanes_; at += kLanes) {
    const Told told = place_box(columns_, at, box, places_);
    futile_ |= told.futile << at;
    falls_ |= told.falls << at;
  }
}

std::optional<PixelRange> BoxOnPlanes::pixels(std::size_t k) const {
  if ((falls_ >> k & 1) == 0) return {};
  const int last = static_cast<int>(columns_.side[k]) - 1;
  const PixelRange range{std::max(places_.i0[k], 0), std::max(places_.j0[k], 0),
                         std::min(places_.i1[k], last), std::min(places_.j1[k], last)};
  if (range.i0 > range.i1 || range.j0 > range.j1) return {};
  return range;
}

PlaneAnswer BoxOnPlanes::answer_of_pixels(std::size_t k) const {
  return answer_on(maps_[k], {places_.i0[k], places_.j0[k], places_.i1[k], places_.j1[k]},
                   {.nearest = places_.before[k], .deepest = places_.deepest[k]});
}

PlaneAnswer BoxOnPlanes::answer(std::size_t k) const {
  if ((futile_ >> k & 1) != 0) return PlaneAnswer::kFutile;
  return (falls_ >> k & 1) != 0 ? answer_of_pixels(k) : PlaneAnswer::kUnknown;
}

}  // namespace pvsfarm

#include "worker/visibility/polygon_cover.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "worker/visibility/dispatch.hpp"
#include "worker/visibility/lanes.hpp"

namespace pvsfarm {
namespace {

constexpr int kMaxPoints = kMaxCoverPoints + 1;  // cut once
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A polygon in the plane's coordinates along and across the words, and its depths.
struct Polygon {
  int count = 0;
  double a[kMaxPoints], b[kMaxPoints], z[kMaxPoints];
};

// Cuts away what lies deeper than `deepest`. False: nothing is left, or it is not convex.
bool cut(Polygon& polygon, double deepest) {
  Polygon in = polygon;
  polygon.count = 0;
  const auto add = [&](double a, double b, double z) {
    if (polygon.count == kMaxPoints) return false;
    polygon.a[polygon.count] = a;
    polygon.b[polygon.count] = b;
    polygon.z[polygon.count++] = z;
    return true;
  };
  int cuts = 0;
  for (int i = 0; i < in.count; ++i) {
    const int k = i + 1 == in.count ? 0 : i + 1;
    const bool kept = in.z[i] <= deepest;
    if (kept && !add(in.a[i], in.b[i], in.z[i])) return false;
    if (kept == (in.z[k] <= deepest)) continue;
    const double t = (in.z[i] - deepest) / (in.z[i] - in.z[k]);
    if (++cuts > 2 ||
        !add(in.a[i] + (in.a[k] - in.a[i]) * t, in.b[i] + (in.b[k] - in.b[i]) * t, deepest))
      return false;
  }
  return polygon.count >= 3;
}

// Its images from the cell's eight vertices, a lane each, and the rectangle they share; see
// projection.cpp.
struct Views {
  Eight a[kMaxPoints], b[kMaxPoints];
  double rounding = 0, margin = 0;
  double a_lo = 0, a_hi = 0, b_lo = 0, b_hi = 0;
  int turn = 0;  // 1: counter-clockwise in all views, -1: clockwise; 0: neither
};

PVSFARM_DISPATCH
void look(const Polygon& polygon, const PolygonPlane& plane, const BitGrid& grid, Views& views) {
  const double ha = plane.half_along, hb = plane.half_across;
  const double front = plane.front, back = plane.back;
  const Eight va{-ha, ha, -ha, ha, -ha, ha, -ha, ha}, vb{-hb, -hb, hb, hb, -hb, -hb, hb, hb};
  const Eight depth{back, back, back, back, front, front, front, front};
  Eight least_a = all_lanes(kInfinity), most_a = -least_a, least_b = least_a, most_b = -least_a;
  Eight largest_alpha = all_lanes(0);
  double scale = plane.frame_scale + ha + hb + back;
  for (int i = 0; i < polygon.count; ++i) {
    const Eight pa = all_lanes(polygon.a[i]), pb = all_lanes(polygon.b[i]);
    const Eight alpha = depth / (polygon.z[i] + depth);
    largest_alpha = larger(alpha, largest_alpha);
    const Eight a = va + (pa - va) * alpha, b = vb + (pb - vb) * alpha;
    least_a = smaller(a, least_a);
    most_a = larger(a, most_a);
    least_b = smaller(b, least_b);
    most_b = larger(b, most_b);
    views.a[i] = a;
    views.b[i] = b;
    for (const double c : {polygon.a[i], polygon.b[i], polygon.z[i]})
      scale = std::max(scale, std::abs(c));
  }
  const double stretch = 1 + largest(largest_alpha);
  views.rounding = 0x1p-44 * stretch * stretch * scale;
  views.margin = views.rounding + 1e-6 * std::min(grid.pa, grid.pb);
  views.a_lo = std::max(largest(least_a) + views.margin, grid.a0);
  views.a_hi = std::min(smallest(most_a) - views.margin, grid.a0 + grid.columns * grid.pa);
  views.b_lo = std::max(largest(least_b) + views.margin, grid.b0);
  views.b_hi = std::min(smallest(most_b) - views.margin, grid.b0 + grid.rows * grid.pb);
  Eight area = all_lanes(0);
  for (int i = 1; i + 1 < polygon.count; ++i)
    area += (views.a[i] - views.a[0]) * (views.b[i + 1] - views.b[0]) -
            (views.a[i + 1] - views.a[0]) * (views.b[i] - views.b[0]);
  views.turn = smallest(area) > 0 ? 1 : largest(area) < 0 ? -1 : 0;
}

// na * a + nb * b >= c, in each of the views.
struct Edges {
  Eight na[kMaxPoints], nb[kMaxPoints], c[kMaxPoints];
};

// The edges, moved inwards. Those along the rows narrow the views' rectangle: they are decided for
// its whole width, without a division by na. False: nothing is left.
PVSFARM_DISPATCH
bool find_edges(int count, const BitGrid& grid, Views& views, Edges& edges) {
  const double map_size = grid.columns * grid.pa + grid.rows * grid.pb;
  const double width = views.a_hi - views.a_lo;
  const double reach = std::max(std::abs(views.b_lo), std::abs(views.b_hi));
  for (int i = 0; i < count; ++i) {
    const int k = i + 1 == count ? 0 : i + 1, from = views.turn > 0 ? i : k, to = i + k - from;
    const Eight na = views.b[from] - views.b[to], nb = views.a[to] - views.a[from];
    const Eight ta = na * views.a[from], tb = nb * views.b[from];
    const Eight abs_na = magnitude(na), abs_nb = magnitude(nb), size = abs_na + abs_nb;
    const Eight c = ta + tb + (views.margin * size + views.rounding * map_size) +
                    0x1p-48 * (magnitude(ta) + magnitude(tb));
    edges.na[i] = na;
    edges.nb[i] = nb;
    edges.c[i] = c;
    const Eight flat = not_above(abs_na * width, 1e-6 * abs_nb * grid.pb);
    if (largest(flat) == 0) continue;
    const Eight worst_a = smaller(na * views.a_lo, na * views.a_hi);
    const Eight slack = 0x1p-47 * (magnitude(worst_a) + abs_nb * reach + magnitude(c));
    const Eight level = (c + slack - worst_a) / nb, none = all_lanes(kInfinity);
    const Eight zero = all_lanes(0);
    if (largest(flat * equal(nb, zero)) > 0) return false;
    views.b_lo = std::max(views.b_lo, largest(choose(flat * above(nb, zero), level, -none)));
    views.b_hi = std::min(views.b_hi, smallest(choose(flat * above(zero, nb), level, none)));
  }
  return views.b_lo < views.b_hi;
}

// Of lines from `first` to `last`, larger than `least` in either: those that bound the others. The
// one that is largest at one end rules out all that are not larger at the other; a lane each.
PVSFARM_INLINE unsigned ruling(const Eight& candidates, const Eight& first, const Eight& last) {
  const Eight none = all_lanes(-kInfinity);
  const Eight f = choose(candidates, first, none), l = choose(candidates, last, none);
  const Eight most_f = all_lanes(largest(f)), most_l = all_lanes(largest(l));
  const Eight l_of_most_f = all_lanes(largest(f == most_f ? l : none));
  const Eight f_of_most_l = all_lanes(largest(l == most_l ? f : none));
  const unsigned a = bits_of(equal(f, most_f)) & bits_of(equal(l, l_of_most_f));
  const unsigned b = bits_of(equal(l, most_l)) & bits_of(equal(f, f_of_most_l));
  if ((a & b) != 0) return (a & b) & -(a & b);
  return (a & -a) | (b & -b) | (bits_of(above(f, f_of_most_l)) & bits_of(above(l, l_of_most_f)));
}

// The other edges, as bounds of rows. Lines that the rectangle outdoes are left out, and those that
// other views of the edge outdo.
PVSFARM_DISPATCH
void add_lines(int count, const BitGrid& grid, const Views& views, const Edges& edges,
               RowShape& shape) {
  const double width = views.a_hi - views.a_lo, last = shape.count - 1;
  const double reach = std::max(std::abs(views.b_lo), std::abs(views.b_hi)) + grid.pb;
  const Eight low = all_lanes(grid.b0 + shape.first * grid.pb), high = low + grid.pb;
  for (int i = 0; i < count; ++i) {
    const Eight na = edges.na[i], nb = edges.nb[i], one_over = 1 / na;
    const Eight steep = magnitude(na) * width - 1e-6 * magnitude(nb) * grid.pb;
    const Eight slope = -nb * one_over, offset = edges.c[i] * one_over;
    const Eight slack = 0x1p-47 * (magnitude(offset) + magnitude(slope) * reach);
    const Eight inwards = na > 0 ? slack : -slack;
    const Eight at_first = offset + inwards + slope * (nb > 0 ? low : high);
    const Eight step = slope * grid.pb, at_last = at_first + step * last;
    const Eight beyond = larger(at_first, at_last) - views.a_lo;
    const Eight before = views.a_hi - smaller(at_first, at_last);
    const Eight lefts = above(smaller(smaller(steep, na), beyond), all_lanes(0));
    const Eight rights = above(smaller(smaller(steep, -na), before), all_lanes(0));
    double firsts[8], steps[8];
    store_lanes(firsts, at_first);
    store_lanes(steps, step);
    if (largest(lefts) > 0)
      for (unsigned rest = ruling(lefts, at_first, at_last); rest != 0; rest &= rest - 1) {
        const int k = __builtin_ctz(rest);
        shape.lefts[shape.left_count++] = {firsts[k], steps[k]};
      }
    if (largest(rights) > 0)
      for (unsigned rest = ruling(rights, -at_first, -at_last); rest != 0; rest &= rest - 1) {
        const int k = __builtin_ctz(rest);
        shape.rights[shape.right_count++] = {firsts[k], steps[k]};
      }
  }
}

}  // namespace

PolygonPlane polygon_plane(const SweepPlane& where, double nearest, double frame_scale) {
  const ProjectionPlane& p = where.plane;
  const bool x = where.along == MapAxis::kX;
  return {.along = x ? p.face.u() : p.face.v(),
          .across = x ? p.face.v() : p.face.u(),
          .away = p.face.axis,
          .sign = static_cast<double>(p.face.sign),
          .half_along = x ? p.hu : p.hv,
          .half_across = x ? p.hv : p.hu,
          .half_away = p.hw,
          .front = p.distance,
          .back = p.distance + 2 * p.hw,
          .nearest = nearest,
          .deepest = where.bound - p.distance,
          .frame_scale = frame_scale};
}

// As legal_for_cell has it; the margin decides only whether the polygon is used.
int side_of_cell(std::span<const Vec3> local, double flatness, const CellFrame& frame) {
  Vec3 n(0);
  double scale = length(local[0]);
  for (std::size_t i = 1; i < local.size(); ++i) {
    scale = std::max(scale, length(local[i]));
    if (i + 1 < local.size()) n += cross(local[i] - local[0], local[i + 1] - local[0]);
  }
  const Vec3 half = frame.half();
  const double size = std::abs(n.x) + std::abs(n.y) + std::abs(n.z), offset = dot(n, local[0]);
  const double reach = std::abs(n.x) * half.x + std::abs(n.y) * half.y + std::abs(n.z) * half.z;
  const double cell = half.x + half.y + half.z;
  const double margin = (4 * flatness + 0x1p-46 * (scale + frame.offset_scale() + cell)) * size;
  if (-offset - reach > margin) return 1;
  if (offset - reach > margin) return -1;
  return 0;
}

Cover cover_polygon(const PolygonPlane& plane, std::span<const Vec3> local, double flatness,
                    CoverageBits& map, RowShape& shape) {
  if (local.size() < 3 || local.size() > kMaxCoverPoints) return Cover::kLongWay;
  Polygon polygon;
  polygon.count = static_cast<int>(local.size());
  double z_lo = kInfinity, z_hi = -kInfinity;
  for (int i = 0; i < polygon.count; ++i) {
    polygon.a[i] = local[i][plane.along];
    polygon.b[i] = local[i][plane.across];
    polygon.z[i] = plane.sign * local[i][plane.away] - plane.half_away - plane.front;
    z_lo = std::min(z_lo, polygon.z[i]);
    z_hi = std::max(z_hi, polygon.z[i]);
  }
  if (!(z_lo >= plane.nearest + 4 * flatness)) return Cover::kLongWay;
  const double rounding = 0x1p-45 * (std::abs(z_hi) + plane.front + plane.frame_scale);
  if (z_hi + 2 * flatness + rounding > plane.deepest) {
    if (flatness > 0) return Cover::kLongWay;
    if (!cut(polygon, plane.deepest - rounding)) return Cover::kNothing;
  }
  const BitGrid& grid = map.grid();
  Views views;
  look(polygon, plane, grid, views);
  if (views.turn == 0) return Cover::kNothing;
  const BitRange range = grid.whole(views.a_lo, views.a_hi, views.b_lo, views.b_hi);
  if (range.empty() || map.all_covered(range)) return Cover::kNothing;
  Edges edges;
  if (!find_edges(polygon.count, grid, views, edges)) return Cover::kNothing;
  const BitRange rows = grid.whole(views.a_lo, views.a_hi, views.b_lo, views.b_hi);
  if (rows.empty()) return Cover::kNothing;
  shape.begin(rows, views.a_lo, views.a_hi);
  add_lines(polygon.count, grid, views, edges, shape);
  map.fill(shape);
  return Cover::kAdded;
}

}  // namespace pvsfarm

#include "tests/adversarial/reference/improved_reference.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/check.hpp"

namespace pvsfarm::reference {
namespace {

constexpr double kGrid = 1e6;  // of the exact oracle, per unit

double grid_below(double x) { return (std::floor(x * kGrid) - 1) / kGrid; }
double grid_above(double x) { return (std::ceil(x * kGrid) + 1) / kGrid; }

struct Interval {
  double lo = std::numeric_limits<double>::infinity();
  double hi = -std::numeric_limits<double>::infinity();
};

// The views of one vertex of the occludee (m across, z deep) from the corners of the cell.
Interval view(const ImprovedQuery& q, int axis, ViewedFrom from, double m, double z) {
  Interval seen;
  for (const double vx : {q.cell.lo[axis], q.cell.hi[axis]})
    for (const double vz :
         {q.cell.hi.z, from == ViewedFrom::kWholeCell ? q.cell.lo.z : q.cell.hi.z}) {
      const double x = vx + (m - vx) * ((q.plane_z - vz) / (z - vz));
      seen.lo = std::min(seen.lo, x);
      seen.hi = std::max(seen.hi, x);
    }
  return seen;
}

bool covers(const ExactPolygon& polygon, const Vec3& eye, const Vec3& p) {
  return polygon.sight(exact(eye), exact(p)) == Sight::kBlocked;
}

}  // namespace

PlaneRectangle improved_projection(const ImprovedQuery& q, ViewedFrom from) {
  PVS_CHECK_LT(q.cell.hi.z, q.occludee.lo.z);
  PVS_CHECK_LE(q.occludee.hi.z, q.plane_z);
  PlaneRectangle rectangle;
  for (int axis = 0; axis < 2; ++axis) {
    double least_hi = std::numeric_limits<double>::infinity(), most_lo = -least_hi;
    for (const double m : {q.occludee.lo[axis], q.occludee.hi[axis]})
      for (const double z : {q.occludee.lo.z, q.occludee.hi.z}) {
        const Interval seen = view(q, axis, from, m, z);
        least_hi = std::min(least_hi, seen.hi);
        most_lo = std::max(most_lo, seen.lo);
      }
    if (least_hi <= most_lo) {
      rectangle.lo[axis] = grid_below(least_hi);
      rectangle.hi[axis] = grid_above(most_lo);
    } else {
      rectangle.lo[axis] = rectangle.hi[axis] =
          std::round((least_hi + most_lo) / 2 * kGrid) / kGrid;
    }
  }
  return rectangle;
}

bool hides_improved(const std::vector<std::vector<Vec3>>& convex_polygons, const ImprovedQuery& q,
                    ViewedFrom from, Umbra umbra) {
  std::vector<ExactPolygon> before;
  for (const auto& polygon : convex_polygons)
    if (std::all_of(polygon.begin(), polygon.end(),
                    [&](const Vec3& p) { return p.z < q.occludee.lo.z && p.z > q.cell.hi.z; }))
      before.emplace_back(polygon);
  const PlaneRectangle r = improved_projection(q, from);
  const auto from_every_corner = [&](auto&& blocked) {
    for (int corner = 0; corner < 4; ++corner)
      for (int v = 0; v < 8; ++v)
        if (!blocked(q.cell.corner(v), Vec3{(corner & 1) ? r.hi[0] : r.lo[0],
                                            (corner & 2) ? r.hi[1] : r.lo[1], q.plane_z}))
          return false;
    return true;
  };
  if (umbra == Umbra::kOneOccluder)
    return std::any_of(before.begin(), before.end(), [&](const ExactPolygon& polygon) {
      // Its Projection is convex: it holds the rectangle if it holds the corners.
      return from_every_corner(
          [&](const Vec3& eye, const Vec3& p) { return covers(polygon, eye, p); });
    });
  return from_every_corner([&](const Vec3& eye, const Vec3& p) {
    return std::any_of(before.begin(), before.end(),
                       [&](const ExactPolygon& polygon) { return covers(polygon, eye, p); });
  });
}

}  // namespace pvsfarm::reference

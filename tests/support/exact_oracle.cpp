#include "tests/support/exact_oracle.hpp"

#include <cmath>
#include <cstdlib>

#include "common/base/check.hpp"

namespace pvsfarm {
namespace {

using Wide = __int128;
constexpr double kUnitsPerSceneUnit = 1e6;
constexpr std::int64_t kLargestDifference = std::int64_t{1} << 40;

ExactPoint minus(const ExactPoint& a, const ExactPoint& b) {
  ExactPoint d;
  for (int k = 0; k < 3; ++k) {
    d.v[k] = a.v[k] - b.v[k];
    PVS_CHECK_LT(std::abs(d.v[k]), kLargestDifference);
  }
  return d;
}

// Sign of det[b - a, c - a, d - a].
int orientation(const ExactPoint& a, const ExactPoint& b, const ExactPoint& c,
                const ExactPoint& d) {
  const ExactPoint p = minus(b, a), q = minus(c, a), r = minus(d, a);
  const auto minor = [&](int i, int j) { return Wide{q.v[i]} * r.v[j] - Wide{q.v[j]} * r.v[i]; };
  const Wide det = p.v[0] * minor(1, 2) + p.v[1] * minor(2, 0) + p.v[2] * minor(0, 1);
  return det > 0 ? 1 : det < 0 ? -1 : 0;
}

}  // namespace

ExactPoint exact(const Vec3& p) {
  ExactPoint r;
  for (int k = 0; k < 3; ++k) {
    r.v[k] = std::llround(p[k] * kUnitsPerSceneUnit);
    PVS_CHECK_EQ(static_cast<double>(r.v[k]) / kUnitsPerSceneUnit, p[k]);
  }
  return r;
}

ExactPolygon::ExactPolygon(const std::vector<Vec3>& points) {
  PVS_CHECK_LE(3u, points.size());
  for (const Vec3& p : points) points_.push_back(exact(p));
}

Sight ExactPolygon::sight(const ExactPoint& from, const ExactPoint& to) const {
  const int a = orientation(points_[0], points_[1], points_[2], from);
  const int b = orientation(points_[0], points_[1], points_[2], to);
  if (a == 0 && b == 0) return Sight::kGrazing;
  if (b == 0 || a * b > 0) return Sight::kClear;  // `to` itself is not part of the segment
  // The line crosses the plane; inside the polygon it passes all edges on the same side.
  int left = 0, right = 0;
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const int side = orientation(from, to, points_[k], points_[(k + 1) % points_.size()]);
    left += side > 0;
    right += side < 0;
  }
  return left > 0 && right > 0 ? Sight::kClear : Sight::kBlocked;
}

std::vector<std::vector<Vec3>> face_loops(const Box& box) {
  constexpr int kCorners[4] = {0, 1, 3, 2};  // around a face, bits of its two axes
  std::vector<std::vector<Vec3>> faces;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, w = (axis + 2) % 3;
    if (box.lo[u] == box.hi[u] || box.lo[w] == box.hi[w]) continue;
    const int sides = box.lo[axis] == box.hi[axis] ? 1 : 2;
    for (int side = 0; side < sides; ++side) {
      std::vector<Vec3> points;
      for (int c : kCorners)
        points.push_back(box.corner(side << axis | (c & 1) << u | (c >> 1) << w));
      faces.push_back(std::move(points));
    }
  }
  return faces;
}

std::vector<ExactPolygon> exact_faces(const Box& box) {
  std::vector<ExactPolygon> faces;
  for (const std::vector<Vec3>& loop : face_loops(box)) faces.emplace_back(loop);
  return faces;
}

Sight sight(const std::vector<ExactPolygon>& matter, const ExactPoint& from, const ExactPoint& to) {
  Sight all = Sight::kClear;
  for (const ExactPolygon& polygon : matter) {
    const Sight one = polygon.sight(from, to);
    if (one == Sight::kBlocked) return one;
    if (one == Sight::kGrazing) all = one;
  }
  return all;
}

bool hides(const ExactPolygon& polygon, const Box& cell, const Box& occludee) {
  for (int k = 0; k < 8; ++k)
    for (int m = 0; m < 8; ++m)
      if (polygon.sight(exact(cell.corner(k)), exact(occludee.corner(m))) != Sight::kBlocked)
        return false;
  return true;
}

}  // namespace pvsfarm

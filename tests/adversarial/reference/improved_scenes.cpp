#include "tests/adversarial/reference/improved_scenes.hpp"

#include <algorithm>
#include <cmath>

#include "common/base/random.hpp"

namespace pvsfarm::reference {
namespace {

// The convex hull of points of one plane z, counter-clockwise.
std::vector<Vec3> hull_of(std::vector<Vec3> points) {
  std::sort(points.begin(), points.end(),
            [](const Vec3& a, const Vec3& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  std::vector<Vec3> hull;
  const auto add = [&](const Vec3& p, std::size_t least) {
    while (hull.size() >= least &&
           cross(hull.back() - hull[hull.size() - 2], p - hull.back()).z <= 0)
      hull.pop_back();
    hull.push_back(p);
  };
  for (const Vec3& p : points) add(p, 2);
  const std::size_t lower = hull.size();
  for (auto p = points.rbegin() + 1; p != points.rend(); ++p) add(*p, lower + 1);
  hull.pop_back();
  return hull;
}

}  // namespace

double decimal(double x) { return std::round(x * 1e6) / 1e6; }

ImprovedScene improved_scene(std::uint64_t seed, double slack) {
  Random random(seed);
  const auto between = [&](double lo, double hi) { return decimal(random.between(lo, hi)); };
  const double front = between(-10, -2), deep = random.below(4) == 0 ? 0 : between(0.1, 30);
  const double hx = between(0.1, 2), hy = between(0.1, 2);
  ImprovedScene s;
  s.query.cell = {{-hx, -hy, decimal(front - deep)}, {hx, hy, front}};
  const Vec3 lo{between(-8, 8), between(-8, 8), decimal(front * random.between(0.1, 0.6))};
  s.query.occludee = {lo,
                      {decimal(lo.x + between(0.01, 3)), decimal(lo.y + between(0.01, 3)),
                       decimal(lo.z * random.between(0.1, 1))}};
  const double z = decimal(front + (lo.z - front) * random.between(0.2, 0.95));
  const auto from = random.below(2) == 0 ? ViewedFrom::kWholeCell : ViewedFrom::kFrontFace;
  s.rectangle = improved_projection(s.query, from);
  const PlaneRectangle& r = s.rectangle;
  const double more = slack * std::max(r.hi[0] - r.lo[0], r.hi[1] - r.lo[1]);
  std::vector<Vec3> points;
  for (int corner = 0; corner < 4; ++corner)
    for (int v = 0; v < 8; ++v) {
      const Vec3 eye = s.query.cell.corner(v);
      const Vec3 p{(corner & 1) ? r.hi[0] + more : r.lo[0] - more,
                   (corner & 2) ? r.hi[1] + more : r.lo[1] - more, 0};
      const Vec3 at = eye + (p - eye) * ((z - eye.z) / -eye.z);
      for (int k = 0; k < 4; ++k)  // a little more, for the grid
        points.push_back({decimal(at.x + ((k & 1) ? 2e-6 : -2e-6)),
                          decimal(at.y + ((k & 2) ? 2e-6 : -2e-6)), z});
    }
  s.occluder = hull_of(points);
  return s;
}

}  // namespace pvsfarm::reference

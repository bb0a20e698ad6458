#include "tests/support/make_solids.hpp"

#include <cmath>
#include <utility>

namespace pvsfarm {

SourceObject fine_box(const Box& box, int n, int sides) {
  SourceObject object;
  object.name = "box";
  for (int axis = 0; axis < 3; ++axis)
    for (const int high : {0, 1}) {
      if ((sides & (1 << (2 * axis + high))) == 0) continue;
      const int u = (axis + (high == 1 ? 1 : 2)) % 3, v = (axis + (high == 1 ? 2 : 1)) % 3;
      add_sheet(object, n, [&](int i, int j) {
        Vec3 p;
        p[axis] = high == 1 ? box.hi[axis] : box.lo[axis];
        p[u] = i == n ? box.hi[u] : box.lo[u] + (box.hi[u] - box.lo[u]) * i / n;
        p[v] = j == n ? box.hi[v] : box.lo[v] + (box.hi[v] - box.lo[v]) * j / n;
        return p;
      });
    }
  return object;
}

SourceObject torus(double x, double radius, double thickness, int n) {
  SourceObject object;
  object.name = "torus";
  add_sheet(
      object, n,
      [&](int i, int j) {
        const double a = 2 * M_PI * i / n, b = 2 * M_PI * j / n;
        const double r = radius + thickness * std::cos(b);
        return Vec3(x + thickness * std::sin(b), r * std::cos(a), r * std::sin(a));
      },
      true);
  return object;
}

SourceObject extruded(const std::vector<Vec2>& line, double x0, double x1) {
  SourceObject object;
  object.name = "prism";
  const auto n = static_cast<std::uint32_t>(line.size());
  for (const double x : {x0, x1})
    for (const Vec2& p : line) object.vertices.emplace_back(x, p.x, p.y);
  object.vertices.emplace_back(x0, 0, 0);
  object.vertices.emplace_back(x1, 0, 0);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    object.triangles.push_back({i, j, n + j});
    object.triangles.push_back({i, n + j, n + i});
    object.triangles.push_back({2 * n, j, i});
    object.triangles.push_back({2 * n + 1, n + i, n + j});
  }
  return object;
}

void turn_inside_out(SourceObject& object) {
  for (auto& t : object.triangles) std::swap(t[1], t[2]);
}

}  // namespace pvsfarm

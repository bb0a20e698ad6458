// Small shapes for the tests of scenes, and what a test asks of a built scene.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "common/base/random.hpp"
#include "common/geometry/box.hpp"
#include "common/scene/scene.hpp"
#include "common/scene/scene_build.hpp"

namespace pvsfarm {

// A closed box of twelve triangles, counter-clockwise seen from outside.
inline SourceObject box_object(std::string name, const Box& box) {
  SourceObject object;
  object.name = std::move(name);
  for (int k = 0; k < 8; ++k) object.vertices.push_back(box.corner(k));
  object.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return object;
}

// Turned about the vertical axis and rounded to float, as a file would hold it.
inline SourceObject turned(SourceObject object, double angle, const Vec3& move) {
  for (Vec3& p : object.vertices) {
    const Vec3 q = Vec3(p.x * std::cos(angle) - p.y * std::sin(angle),
                        p.x * std::sin(angle) + p.y * std::cos(angle), p.z) +
                   move;
    p = Vec3(static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z));
  }
  return object;
}

// An upright prism over a convex ring, its roof ring scaled by `taper` about the ring's mean.
inline SourceObject prism_object(std::string name, const std::vector<Vec2>& ring, double base,
                                 double top, double taper = 1) {
  SourceObject object;
  object.name = std::move(name);
  Vec2 mean(0.0);
  for (const Vec2& p : ring) mean += p / static_cast<double>(ring.size());
  for (const Vec2& p : ring) object.vertices.emplace_back(p.x, p.y, base);
  for (const Vec2& p : ring) {
    const Vec2 q = taper == 1 ? p : mean + (p - mean) * taper;
    object.vertices.emplace_back(q.x, q.y, top);
  }
  const auto n = static_cast<std::uint32_t>(ring.size());
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    object.triangles.push_back({i, j, n + j});
    object.triangles.push_back({i, n + j, n + i});
    if (i > 0 && j > 0) {
      object.triangles.push_back({0, j, i});
      object.triangles.push_back({n, n + i, n + j});
    }
  }
  return object;
}

inline std::vector<Vec2> regular_ring(int corners, double radius, const Vec2& middle) {
  std::vector<Vec2> ring;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * M_PI * i / corners + 0.1;
    ring.push_back(middle + radius * Vec2(std::cos(angle), std::sin(angle)));
  }
  return ring;
}

// An upright block over unit squares of the plane, given by their low corners.
inline SourceObject block_object(std::string name, const std::vector<std::array<int, 2>>& squares,
                                 double base, double top) {
  SourceObject object;
  object.name = std::move(name);
  const auto has = [&squares](int x, int y) {
    return std::find(squares.begin(), squares.end(), std::array<int, 2>{x, y}) != squares.end();
  };
  const auto quad = [&object](const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const auto v = static_cast<std::uint32_t>(object.vertices.size());
    object.vertices.insert(object.vertices.end(), {a, b, c, d});
    object.triangles.push_back({v, v + 1, v + 2});
    object.triangles.push_back({v, v + 2, v + 3});
  };
  for (const auto& [x, y] : squares) {
    const Vec3 a(x, y, base), b(x + 1, y, base), c(x + 1, y + 1, base), d(x, y + 1, base);
    const Vec3 up(0, 0, top - base);
    quad(a, d, c, b);
    quad(a + up, b + up, c + up, d + up);
    if (!has(x, y - 1)) quad(a, b, b + up, a + up);
    if (!has(x + 1, y)) quad(b, c, c + up, b + up);
    if (!has(x, y + 1)) quad(c, d, d + up, c + up);
    if (!has(x - 1, y)) quad(d, a, a + up, d + up);
  }
  return object;
}

inline SourceObject joined(SourceObject a, const SourceObject& b) {
  const auto base = static_cast<std::uint32_t>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const auto& t : b.triangles) a.triangles.push_back({base + t[0], base + t[1], base + t[2]});
  return a;
}

inline std::shared_ptr<const Scene> scene_of(std::vector<SourceObject> objects) {
  return build_scene({.objects = std::move(objects)}).value();
}

inline std::vector<Occluder> solids_of(const Scene& scene) {
  std::vector<Occluder> solids;
  for (const Occluder& o : scene.occluders())
    if (o.shape == OccluderShape::kSolid) solids.push_back(o);
  return solids;
}

inline std::vector<Occluder> polygons_of(const Scene& scene) {
  std::vector<Occluder> polygons;
  for (const Occluder& o : scene.occluders())
    if (o.shape == OccluderShape::kPolygon) polygons.push_back(o);
  return polygons;
}

}  // namespace pvsfarm

// Meshes for the tests of surfaces, and what a test asks of the surfaces of a scene.
#pragma once

#include "tests/unit/scene_shapes.hpp"

namespace pvsfarm {

inline SourceObject triangles_object(std::string name,
                                     const std::vector<std::array<Vec3, 3>>& triangles) {
  SourceObject object;
  object.name = std::move(name);
  for (const auto& t : triangles) {
    const auto v = static_cast<std::uint32_t>(object.vertices.size());
    object.vertices.insert(object.vertices.end(), t.begin(), t.end());
    object.triangles.push_back({v, v + 1, v + 2});
  }
  return object;
}

// Counter-clockwise loops of four, each as two triangles.
inline SourceObject quads_object(std::string name, const std::vector<std::array<Vec3, 4>>& quads) {
  std::vector<std::array<Vec3, 3>> triangles;
  for (const auto& q : quads) {
    triangles.push_back({q[0], q[1], q[2]});
    triangles.push_back({q[0], q[2], q[3]});
  }
  return triangles_object(std::move(name), triangles);
}

// A wall in the plane y = `y`, from x0 to x1 and z0 to z1.
inline std::array<Vec3, 4> wall(double x0, double x1, double y, double z0, double z1) {
  return {Vec3(x0, y, z0), Vec3(x1, y, z0), Vec3(x1, y, z1), Vec3(x0, y, z1)};
}

// How many triangles each edge has.
inline std::vector<int> uses_of(const Scene& scene) {
  std::vector<int> uses(scene.surface_edges().size(), 0);
  for (const SurfaceTriangle& t : scene.surface_triangles())
    for (const std::int32_t e : t.edge) ++uses[e >= 0 ? e : ~e];
  return uses;
}
inline int edges_with(const Scene& scene, int triangles) {
  const std::vector<int> uses = uses_of(scene);
  return static_cast<int>(std::count(uses.begin(), uses.end(), triangles));
}

inline Vec3 area_of(const Scene& scene, const SurfaceTriangle& t) {
  const Vec3& a = scene.surface_vertices()[t.vertex[0]];
  return cross(scene.surface_vertices()[t.vertex[1]] - a,
               scene.surface_vertices()[t.vertex[2]] - a) /
         2.0;
}
inline double total_area(const Scene& scene) {
  double area = 0;
  for (const SurfaceTriangle& t : scene.surface_triangles()) area += length(area_of(scene, t));
  return area;
}

}  // namespace pvsfarm

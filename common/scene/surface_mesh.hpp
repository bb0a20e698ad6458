// The scene's opaque surfaces: triangles of all static occluders together, as components that hang
// together by whole edges (records in surface.hpp).
#pragma once

#include <span>
#include <vector>

#include "common/scene/surface.hpp"
#include "common/scene/surface_weld.hpp"

namespace pvsfarm {

// [limit] Triangles kept. Components with little area a triangle go first: leaving out is safe.
inline constexpr std::size_t kMaxSurfaceTriangles = 2'000'000;

// [limit] Of more triangles that share no edge with any other as they come, none is kept, though a
// vertex on an edge might yet join it to others.
inline constexpr std::size_t kMaxLoneTriangles = 50'000;

struct SurfaceMesh {
  std::vector<Vec3> vertices;  // only those in use
  std::vector<SurfaceEdge> edges;
  std::vector<SurfaceTriangle> triangles;
  std::vector<SurfaceComponent> components;
};

// The same whatever the order of the inputs.
// Left out: single triangles, and convex closed components of few points, which are occluders as
// polygons and solids already.
SurfaceMesh make_surfaces(std::span<const SurfaceInput> inputs);

}  // namespace pvsfarm

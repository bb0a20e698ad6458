// Records of the scene's opaque surfaces: triangles that share whole edges, so that the worker can
// see a mesh as one occluder whose only borders are those it has towards a given cell.
//
// Several triangles may share an edge, and an edge may have one triangle only. Vertices are equal
// exactly or not at all: what is torn by 10^-9 stays torn (doubt means visible).
#pragma once

#include <cstdint>

#include "common/geometry/box.hpp"

namespace pvsfarm {

struct SurfaceEdge {
  std::uint32_t vertex[2];  // into Scene::surface_vertices(), vertex[0] < vertex[1]
};

struct SurfaceTriangle {
  // Counter-clockwise seen from the front; not degenerate. Of those that block from both sides,
  // closed solids look outwards, and neighbours over an edge with two triangles agree if they can.
  std::uint32_t vertex[3];
  // From vertex[k] to vertex[(k + 1) % 3]: e >= 0 runs as surface_edges()[e] does, else ~e against.
  std::int32_t edge[3];
  std::uint32_t one_sided = 0;  // 1: blocks only rays that meet its front
};
static_assert(sizeof(SurfaceTriangle) == 28);

// Triangles that hang together by edges, contiguous.
struct SurfaceComponent {
  Box box;
  std::uint32_t first_triangle = 0, triangle_count = 0;  // into Scene::surface_triangles()
  std::uint32_t first_edge = 0, edge_count = 0;          // into Scene::surface_edges(), all of its
  double area = 0;                                       // [square scene units] of its triangles
};
static_assert(sizeof(SurfaceComponent) == 72);

}  // namespace pvsfarm

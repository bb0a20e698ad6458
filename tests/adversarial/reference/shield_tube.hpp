// The surfaces that ShieldTester works on: a mesh that may shield, and the tube around two cells.
//
// Source: Navazo 2003, 3 and 4; theory C.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "tests/adversarial/reference/integer_geometry.hpp"

namespace pvsfarm::reference {

// Triangles, counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<IntPoint> vertices;
  std::vector<std::array<int, 3>> triangles;

  const IntPoint& corner(int triangle, int k) const { return vertices[triangles[triangle][k]]; }
  // The plane of the triangle: orientation(...) > 0 is outside.
  int side(int triangle, const IntPoint& p) const {
    return orientation(corner(triangle, 0), corner(triangle, 1), corner(triangle, 2), p);
  }
};

Stab stab(const IntPoint& a, const IntPoint& b, const TriangleMesh& mesh, int triangle);

// Which triangles hold an edge.
class EdgeMap {
 public:
  explicit EdgeMap(const TriangleMesh& mesh);
  const std::vector<int>& around(int a, int b) const;
  // The other triangle of the edge, or -1. Requires: the mesh is manifold.
  int across(int triangle, int a, int b) const;

 private:
  std::map<std::pair<int, int>, std::vector<int>> triangles_;
};

using Corners = std::array<IntPoint, 8>;  // a convex cell is the hull of its corners

// The hull of both cells: its facets as triangles, and whether each belongs to the tube (has
// vertices of both cells). Vertices 0..7 are a's, 8..15 b's.
// None: the hull is flat.
struct Hull {
  TriangleMesh surface;
  std::vector<bool> is_tube;
};
std::optional<Hull> hull_of(const Corners& a, const Corners& b);

// Strictly outside of some facet with both ends: the edge does not meet the hull.
bool misses_hull(const Hull& hull, const IntPoint& p, const IntPoint& q);

// Whether the hull of `moved` holds all of `corners`.
bool contains_all(const Corners& moved, const Corners& corners);

}  // namespace pvsfarm::reference

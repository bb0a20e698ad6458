// Triangles merged into larger flat convex polygons.
#pragma once

#include <span>
#include <vector>

#include "common/scene/mesh.hpp"

namespace pvsfarm {

// [limit] Points of a merged polygon, exactly collinear ones dropped.
inline constexpr std::size_t kMaxPolygonPoints = 32;

struct FlatPolygon {
  // The true boundary of a disc of triangles, counter-clockwise seen from their front: convex up
  // to rounding, exactly collinear points dropped.
  std::vector<Vec3> points;
  double flatness = 0;  // the disc is nowhere farther than this from one plane; rounded up
};

// Every triangle that has an area ends up in exactly one polygon. Merged are neighbours across a
// shared edge that face the same way, lie within a millionth of their size of one plane and have
// a convex union, longest edges first (after Hertel and Mehlhorn 1983). No T-junction is repaired:
// that would move the boundary off the matter.
std::vector<FlatPolygon> merge_coplanar(const Mesh& mesh, std::span<const MeshTriangle> triangles);

}  // namespace pvsfarm

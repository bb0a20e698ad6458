// Closed components that are convex, as points whose hull is proved to lie in matter.
#pragma once

#include <optional>
#include <vector>

#include "common/geometry/box.hpp"
#include "common/scene/mesh_components.hpp"

namespace pvsfarm {

// [limit] Points of a solid and once more those of its base; evaluators leave out what has more.
inline constexpr std::size_t kMaxSolidPoints = 32;

struct ConvexSolid {
  std::vector<Vec3> points;  // the base first, if there is one
  std::size_t base_points = 0;
  bool is_box = false;
  bool is_prism = false;
  double shrink = 0;  // [scene units] how far the matter may reach beyond the points
};

// Coordinates are rounded, so a mesh is convex only up to that: the points are moved towards the
// middle until each is strictly inside every face plane, by at most a thousandth. A point inside
// all face planes of a closed outward mesh has a winding number of at least one, and so has the
// hull of such points. Exact axis-aligned boxes are kept as they are.
//
// The base is kept at its height where the bottom is exactly level and at or below `ground`, and
// nothing overhangs it (theory 0.3).
// Nothing: not closed, not convex, or too thin to tell.
std::optional<ConvexSolid> convex_solid(const Mesh& mesh, const MeshComponent& component,
                                        double ground);

// Whether all faces look away from one point: then no ray enters the component through a back
// face, whatever else its shape (theory 0.2 (c)).
bool is_star_shaped(const Mesh& mesh, const MeshComponent& component);

}  // namespace pvsfarm

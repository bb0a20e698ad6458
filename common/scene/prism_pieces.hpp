// Upright prisms over any footprint, cut into convex ones: most buildings.
#pragma once

#include <vector>

#include "common/scene/convex_solid.hpp"

namespace pvsfarm {

// Convex prisms inside a closed component whose vertices lie exactly in two levels and whose walls
// are exactly vertical. Nothing if it is not one.
//
// Why they lie in matter: below a point over the base, between the levels, there is nothing but
// base triangles, all facing down, so its winding number is the number of those it is above. The
// base triangles are merged into convex polygons, and each polygon's points are moved strictly
// inside all its edges, which its boundary then winds around.
std::vector<ConvexSolid> prism_pieces(const Mesh& mesh, const MeshComponent& component,
                                      double ground);

}  // namespace pvsfarm

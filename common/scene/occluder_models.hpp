// The occluder models of one object: convex solids, and the faces of everything as flat polygons.
#pragma once

#include "common/scene/mesh.hpp"
#include "common/scene/occluder_set.hpp"

namespace pvsfarm {

// Appends the occluders of `mesh` to `set`. What cannot be proved is left out.
// Requires: the object may block rays and does not move.
void model_occluders(const Mesh& mesh, ObjectId owner, bool two_sided, double ground,
                     OccluderSet& set);

}  // namespace pvsfarm

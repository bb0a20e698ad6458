// The occluder models of a scene: convex solids, the faces of everything as flat polygons, and
// rows of boxes joined. What cannot be proved to be matter is left out.
#pragma once

#include "common/scene/mesh_components.hpp"
#include "common/scene/occluder_set.hpp"

namespace pvsfarm {

// Appends the occluders of one object to `set`. `components`: those of its mesh.
// Requires: the object may block rays and does not move.
void model_object(const Mesh& mesh, std::span<const MeshComponent> components, ObjectId owner,
                  bool two_sided, double ground, OccluderSet& set);

// Appends the runs of touching boxes among the solids of `set`, each owned by all its members'
// objects.
void model_box_runs(double ground, OccluderSet& set);

}  // namespace pvsfarm

// The connected parts of an object's mesh, and which of them are closed.
#pragma once

#include <vector>

#include "common/scene/mesh.hpp"

namespace pvsfarm {

// Triangles joined by edges that exactly two triangles share; solids that touch along an edge or
// in a corner stay apart.
struct MeshComponent {
  std::vector<MeshTriangle> triangles;  // without repeated vertices or repeated triangles
  // Every edge is shared by exactly two triangles that run along it in opposite directions, and
  // the volume they enclose is positive: fronts look outwards.
  bool closed_outward = false;
};

// `two_sided`: winding means nothing, so triangles are turned to agree with their neighbours, and
// a closed component to look outwards. Otherwise it is left as the renderer will see it.
// Order: by the first triangle of each component.
std::vector<MeshComponent> split_components(const Mesh& mesh, bool two_sided);

}  // namespace pvsfarm

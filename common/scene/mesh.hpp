// An object's triangles with equal positions joined, and how they hang together.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/geometry/vec.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm {

using MeshTriangle = std::array<std::uint32_t, 3>;

struct Mesh {
  std::vector<Vec3> vertices;           // each position once; -0 is 0
  std::vector<MeshTriangle> triangles;  // all of the source's, in its order
};

// Joins vertices of bit-equal position, in order of first appearance.
// Requires: indices in range, finite vertices.
Mesh weld(const SourceObject& object);

}  // namespace pvsfarm

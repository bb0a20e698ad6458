// Random little worlds on a lattice of integers, where everything coincides: faces with faces and
// with the cell's, corners with edges, walls with planes of projection, one object with another.
#pragma once

#include <cstdint>
#include <vector>

#include "common/cells/cell.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm {

struct LatticeWorld {
  SceneSource source;
  std::vector<Cell> cells;  // aligned, turned, mirrored; boxes, flat cells and points
};

// The same seed gives the same world. Some have a level ground, some are turned, scaled, or moved
// far off the origin.
LatticeWorld lattice_world(std::uint64_t seed);

}  // namespace pvsfarm

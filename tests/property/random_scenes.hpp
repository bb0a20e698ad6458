// Random little worlds that are hard on visibility: one family for each way a method goes wrong.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/cells/cell.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm {

enum class Family {
  kBlocks,    // buildings on level ground, some hovering, cells at eye height
  kPlates,    // tilted convex polygons, one- and two-sided, occludees beyond
  kSlits,     // walls of plates with gaps from nothing to as wide as a cell
  kStraddle,  // slabs along the line of sight before wide cells
  kMeshes,    // non-convex, multi-part, cracked, holed and badly oriented meshes
  kRooms,     // a tessellated room with doors and windows around the cell
  kTouching,  // cells that touch, cut or lie inside matter
  kSolids,    // closed meshes of any shape, nested, around the cell, inside out, not quite closed
  kEarth,     // hills and houses without floors, cells above them, on them, in them
};
inline constexpr Family kFamilies[] = {Family::kBlocks,   Family::kPlates, Family::kSlits,
                                       Family::kStraddle, Family::kMeshes, Family::kRooms,
                                       Family::kTouching, Family::kSolids, Family::kEarth};
const char* to_string(Family family);

struct RandomWorld {
  SceneSource source;
  std::vector<Cell> cells;  // aligned and turned, boxes, flat cells and points
};

// The same seed gives the same world. Worlds are turned, scaled and moved far off the origin, too.
RandomWorld random_world(Family family, std::uint64_t seed);

}  // namespace pvsfarm

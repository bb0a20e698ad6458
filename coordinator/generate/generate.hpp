// The parametric test scenes, one file each. All are pure functions of their request.
// Errors of all: kCommandLine, naming the option out of range.
#pragma once

#include <cstdint>

#include "common/base/result.hpp"
#include "coordinator/generate/generated_scene.hpp"

namespace pvsfarm {

inline constexpr int kBuildingsPerBlock = 16;
inline constexpr int kCarsPerBlock = 40;

// A city of box buildings: blocks of 60 m, streets of 14 m between and around them. Each block has
// a perimeter of 16 buildings 9 to 35 m high standing wall to wall; 15 % of the joints have a gap
// of 0.5 to 2 m. 40 cars a block stand along the kerbs and on the lanes. Ground: a tile a block,
// which does not occlude. Cells tile streets and crossings at eye height; no car reaches up to
// them.
//
// Several districts of that kind stand in rows as near to a square as their number allows, and
// share their streets; cells then tile the streets of the middle one only. With `lanes`, cells lie
// along the streets. Buildings of more than 12 triangles are the same boxes with closed ledges on
// their fronts, cars of more than 24 have the same outlines, tessellated, and wheels: a city of
// the size of Durand 2000, section 7.1.
struct CityRequest {
  int blocks = 20;  // [limit] kMaxBlocks; blocks x blocks a district
  double cell_size = 5;
  std::uint64_t seed = 1;
  int districts = 1;            // [limit] kMaxBlocks blocks along each side in all
  int lanes = 0;                // [limit] kMaxLanes; 0: square cells; n: n cells abreast
  int cars = -1;                // in all, spread evenly; -1: kCarsPerBlock a block, the most
  int building_triangles = 12;  // each; a multiple of 12. [limit] kMaxBuildingTriangles
  int car_triangles = 24;       // each; 24, or a multiple of 4 in city_detail.hpp's range
  bool moving_cars = false;     // dynamic: cars never occlude
};
inline constexpr int kMaxBlocks = 200;
inline constexpr int kMaxLanes = 16;
inline constexpr int kMaxBuildingTriangles = 12'000;
Result<GeneratedScene> generate_city(const CityRequest& request);

// A city whose answer is known: from a street one sees along this street and nowhere else.
// Streets along x run through, closed at both ends by gates; every street along y is cut into
// courts, one a block, closed by gates flush with the crossing streets' fronts. No gaps; the
// buildings are 24 to 35 m high, so that nothing behind the fronts shows over the roofs. Hence what
// a cell sees is among the objects whose boxes meet the box of its street or court.
// At least 2 blocks; no ring road. Of the request it takes blocks, cell size and seed.
Result<GeneratedScene> generate_closed_city(const CityRequest& request);
// The streets and courts of that city: their free space, from front to front and gate to gate.
std::vector<Box> closed_city_streets(const CityRequest& request);

// Conifers of leaf triangles (opaque, single, two-sided, in all directions) round closed trunks, in
// compartments of 10 x 10 trees with rides 6 m wide between and around them. No leaf reaches into a
// ride; cells tile the rides.
//
// With glades: a thicket instead, as dense as a stand of young beeches. Leafy from the ground up,
// without rides; a glade is the place of a tree left out, spread evenly, with one cell in it that
// no leaf reaches into.
struct ForestRequest {
  int trees = 2000;  // [limit] 1,000,000
  int leaves = 200;  // a tree; [limit] 100,000, and 200 million in all
  double cell_size = 5;
  int glades = 0;         // [limit] trees; cells, each at most 3 m wide. 0: rides
  double leaf_size = 0.8;  // of a thicket, in metres: half a leaf's width. [limit] 0.01 .. 2
  std::uint64_t seed = 1;
};
Result<GeneratedScene> generate_forest(const ForestRequest& request);

// rooms x rooms rooms of 6 x 5 m on one floor, 3 m high: walls with doors between them and windows
// outside, watertight and tessellated to half metres; posts, floors, ceilings, low furniture. All
// rooms are connected. Cells tile the rooms and fill the doorways.
struct RoomsRequest {
  int rooms = 8;  // [limit] 500
  double cell_size = 2.5;
  std::uint64_t seed = 1;
};
Result<GeneratedScene> generate_rooms(const RoomsRequest& request);

// Hills: a heightfield of 4 m quads cut into tiles of 64 m, and closed gabled houses standing in
// it. Cells follow two crossing paths a tile, above the ground and below 1.9 m over its highest
// point; where a path is too steep for a box it has none.
struct TerrainRequest {
  int tiles = 8;            // tiles x tiles; [limit] 200
  int houses_per_tile = 4;  // [limit] 4, one a quarter
  double cell_size = 5;
  std::uint64_t seed = 1;
};
Result<GeneratedScene> generate_terrain(const TerrainRequest& request);

// A perfect maze of size x size places 3 m apart: walls and posts 0.25 m thick, 3 m high, without a
// roof. Cells tile the places and fill the passages.
struct MazeRequest {
  int size = 24;  // [limit] 1000
  double cell_size = 3;
  std::uint64_t seed = 1;
};
Result<GeneratedScene> generate_maze(const MazeRequest& request);

}  // namespace pvsfarm

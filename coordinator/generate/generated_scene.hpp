// What every generator makes: a scene and the viewing cells in its free space.
//
// Conventions of all generated scenes, before they are placed elsewhere (placement.hpp): metres, z
// up, level ground at z = 0 exactly (terrain aside). Every vertex coordinate is a multiple of
// 1/1024 m below kMaxCoordinate_m, so it is exact in float32 and in short decimal text: neighbours
// that touch share coordinates bit for bit after any round trip through a file. The same request
// gives the same scene on every machine.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/random.hpp"
#include "common/cells/cell_source.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm {

inline constexpr double kMaxCoordinate_m = 16384;  // 2^24 / 1024: what float32 still holds exactly
inline constexpr double kMinCellSize_m = 0.125;

struct GeneratedScene {
  SceneSource source;
  std::vector<RootCell> cells;
};

// The multiple of 1/1024 nearest to `v`.
double snap(double v);

// A random stream of its own for part `index` of the scene, so that one part does not depend on how
// many numbers another has drawn.
Random stream_of(std::uint64_t seed, std::uint64_t index);

// "building_3_7_12": an object's name from its kind and where it stands.
std::string numbered(std::string_view kind, std::initializer_list<int> numbers);

// lo = c0 < c1 < ... < cn = hi, snapped, in the fewest equal steps not longer than `step`.
std::vector<double> even_steps(double lo, double hi, double step);

// Tiles `region` (its x and y) with cells no wider than `cell_size`, at eye height over z = 0.
// Neighbours share their border bit for bit; ids count on from those already there.
void tile_cells(std::vector<RootCell>& cells, const Box& region, double cell_size);
// The same with cells no longer than `longest` along x and along y.
void tile_cells(std::vector<RootCell>& cells, const Box& region, const Vec2& longest);

// A city's pattern: `columns` x `rows` square blocks with streets between and around them.
// Block b begins at b * (block_m + street_m) + street_m; street s at s * (block_m + street_m).
struct StreetNetwork {
  int columns = 1, rows = 1;
  double block_m = 60;
  double street_m = 14;

  double pitch_m() const { return block_m + street_m; }
  // Of so many blocks in a row and the streets between and around them.
  double extent_m(int blocks) const { return blocks * pitch_m() + street_m; }
  double street_area_m2() const {
    return extent_m(columns) * extent_m(rows) - columns * rows * block_m * block_m;
  }
  double block_begin(int b) const { return b * pitch_m() + street_m; }
  double street_begin(int s) const { return s * pitch_m(); }
  // The ground around block (bx, by), so that the tiles of all blocks cover the whole extent.
  Box ground_tile(int bx, int by) const;
};

// Cells over all streets and crossings, as near to the fronts as an eye comes and no nearer: a cell
// that touches a wall cannot use it, as one of its eyes is in the wall.
inline constexpr double kClearOfFronts_m = 0.25;
void tile_streets(std::vector<RootCell>& cells, const StreetNetwork& network, double cell_size);
// The same over the streets between and around some of the blocks, with cells that lie lengthwise:
// `lanes` abreast in a street (in a crossing along x), no longer than `cell_size`.
struct Lanes {
  double cell_size = 20;
  int abreast = 2;
  int first_column = 0, columns = 1;
  int first_row = 0, rows = 1;
};
void tile_lanes(std::vector<RootCell>& cells, const StreetNetwork& network, const Lanes& lanes);

// Errors: kCommandLine, if so many cells or coordinates so large would not be accepted later.
Status check_cell_size(double cell_size, double free_area_m2);
Status check_range(const char* option, std::int64_t value, std::int64_t lo, std::int64_t hi);

}  // namespace pvsfarm

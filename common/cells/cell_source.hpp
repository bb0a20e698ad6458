// Where root cells come from: a JSON file, or a grid over the walkable volume of the scene.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.hpp"
#include "common/cells/cell.hpp"
#include "common/scene/scene.hpp"

namespace pvsfarm {

inline constexpr std::uint64_t kMaxRootCells = 16'000'000;

// A person's eyes above the floor they stand on: what cells over a floor cover.
inline constexpr double kEyeLow_m = 1.5, kEyeHigh_m = 1.9;

struct RootCell {
  std::int64_t id = 0;  // as the cells file gives it; 0, 1, 2 ... for a grid
  Cell cell;
};

// {"units":"m","up":"z","cells":[{"id":7,"aabb":[[x,y,z],[x,y,z]]} |
//                                {"id":8,"center":[..],"axes":[[..],[..],[..]],"half":[..]}]}
// In file order, turned to z up as the file's "up" says.
// Errors: kInvalidInput (missing, unreadable, zero-size cell [in all three axes], lo > hi,
// duplicate id, NaN, axes not orthonormal, none or too many), naming file and cell and how to mend
// it.
Result<std::vector<RootCell>> read_cells(const std::string& path);

// "grid:SIZE[:HEIGHT]": for each square of SIZE x SIZE, and each storey in it, the least box over
// the places where a person can stand (found with Recast). So cells are cut back at walls and
// edges, and where nobody can stand is none. From kEyeLow_m above the storey's lowest floor in the
// square to kEyeLow_m + HEIGHT above its highest. [scene units, taken for metres]
struct GridRequest {
  double size = 5;
  double height = 0.4;
};
Result<GridRequest> parse_grid(const std::string& text);
Result<std::vector<RootCell>> grid_cells(const Scene& scene, const GridRequest& request);

}  // namespace pvsfarm

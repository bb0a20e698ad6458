// Rows of touching boxes merged into longer ones.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/box.hpp"

namespace pvsfarm {

// [limit] Boxes of one run.
inline constexpr std::size_t kMaxRunBoxes = 64;

struct BoxRun {
  Box box;                             // exactly inside the union of its members
  std::vector<std::uint32_t> members;  // indices into the boxes given, ascending, at least two
};

// The runs of `boxes` along x, y and z: each follows boxes that touch exactly or overlap, and
// spans their common cross-section. A row of houses gives one run for each house that is the
// lowest, or the shallowest, of its neighbours, as in the largest rectangle under a histogram.
// Runs inside another box or run are left out. Order: by axis, then by the box they start from.
std::vector<BoxRun> find_box_runs(std::span<const Box> boxes);

}  // namespace pvsfarm

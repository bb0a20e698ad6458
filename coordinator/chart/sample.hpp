// Which cells stand for all of them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/cells/cell_source.hpp"

namespace pvsfarm {

// Indices of `count` of the cells (of all, if there are fewer), spread evenly: the cells along a
// Morton curve are cut into `count` runs of equal length, and one cell of each is drawn.
std::vector<std::uint32_t> spread_sample(std::span<const RootCell> cells, std::size_t count,
                                         std::uint64_t seed);

}  // namespace pvsfarm

// The leaf cells around a leaf cell, wherever in the hierarchy they are.
#pragma once

#include <cstdint>
#include <vector>

#include "common/pvs/store_reader.hpp"

namespace pvsfarm {

// Those that hold a point beyond the middle of a face: close to it, or half a cell farther, since
// cells may be cut back at walls. In ascending order, without the cell itself.
// Errors: kInvalidInput (damaged store).
Result<std::vector<std::uint32_t>> neighbours_of(StoreReader& store, const StoredNode& node);

}  // namespace pvsfarm

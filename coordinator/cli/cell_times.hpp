// How long each cell took: the file OUT.pvs.stats beside a store, which `bake` writes. It is no
// part of the store, whose bytes do not depend on how fast they were computed.
//
// One JSON object a line, {"cell":N,"ms":1.7}, N the index of the cell in the store.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.hpp"

namespace pvsfarm {

// [ms] of CPU by cell, 0 where unknown; all 0 if there is no such file.
// Errors: kIo (cannot be read), kInvalidInput (naming the line).
Result<std::vector<double>> read_cell_times(const std::string& store_path, std::uint32_t cells);

}  // namespace pvsfarm

// A row's bytes: its identity, and its statistics packed into one column.
#pragma once

#include <span>
#include <vector>

#include "coordinator/journal/result_log.hpp"

namespace pvsfarm {

// LEB128 numbers and the bits of doubles, in the order of the fields; each method in its order,
// then the rounds (common/pvs/rounds.hpp).
std::vector<std::byte> encode(const CellStatistics& statistics);
// False: no such bytes (cut short, too long, a number out of its range).
bool decode_statistics(std::span<const std::byte> bytes, CellStatistics& out);

}  // namespace pvsfarm

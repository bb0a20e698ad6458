// Why a cell was not split, or that it was.
#pragma once

#include <cstdint>

namespace pvsfarm {

// Also bits of a node's flags in a store: never re-number.
enum class LeafReason : std::uint8_t {
  kNone = 0,             // it was split: no leaf
  kNoBudget = 1,         // no polygon budget was set
  kBudgetMet = 2,        // its PVS is within the budget
  kTooSmall = 3,         // half of it would be smaller than the smallest cell
  kPointOverBudget = 4,  // one viewpoint sees more than the budget
  kNothingToGain = 5,    // one viewpoint sees nearly all of its PVS
  kGivenUp = 6,          // nobody could evaluate it: it has its parent's PVS
  kMerged = 7,           // it was split, but the parts agreed
};
inline constexpr int kLeafReasonCount = 8;

const char* to_string(LeafReason reason);  // "budget-met", for programs

}  // namespace pvsfarm

#include "common/pvs/leaf_reason.hpp"

namespace pvsfarm {

const char* to_string(LeafReason reason) {
  switch (reason) {
    case LeafReason::kNone:
      return "split";
    case LeafReason::kNoBudget:
      return "no-budget";
    case LeafReason::kBudgetMet:
      return "budget-met";
    case LeafReason::kTooSmall:
      return "too-small";
    case LeafReason::kPointOverBudget:
      return "point-over-budget";
    case LeafReason::kNothingToGain:
      return "nothing-to-gain";
    case LeafReason::kGivenUp:
      return "given-up";
    case LeafReason::kMerged:
      return "merged";
  }
  return "unknown";
}

}  // namespace pvsfarm

// What `bake` and `coordinate` say when they are done: how much is culled, how sure that is, what
// each method contributed, and what was not computed and why.
#pragma once

#include <string>

#include "coordinator/service/bake.hpp"

namespace pvsfarm {

// `used`: the methods that the bake was to use.
std::string bake_summary_text(const std::string& output, const BakeSummary& summary, Methods used,
                              int verbosity);
std::string bake_summary_json(const std::string& output, const BakeSummary& summary, Methods used);

// For people: "within the budget".
const char* words_for(LeafReason reason);

}  // namespace pvsfarm

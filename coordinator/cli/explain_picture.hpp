// The picture of `pvsfarm explain --picture`.
#pragma once

#include <string>
#include <vector>

#include "coordinator/cli/explanation.hpp"

namespace pvsfarm {

// Errors: kIo.
Status draw_explanation(const Explanation& explanation, const std::vector<StoreObject>& objects,
                        const std::string& path);

}  // namespace pvsfarm

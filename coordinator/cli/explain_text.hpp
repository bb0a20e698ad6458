// An explanation in words, and as JSON: what `pvsfarm explain` prints.
#pragma once

#include <string>
#include <vector>

#include "coordinator/cli/explanation.hpp"

namespace pvsfarm {

// In the scene file's own coordinates, `objects` being the store's.
std::string text_of(const Explanation& explanation, UpAxis up,
                    const std::vector<StoreObject>& objects);
std::string json_of(const Explanation& explanation, UpAxis up,
                    const std::vector<StoreObject>& objects);  // one line

// "wall_3", or "wall_3, wall_4 and 5 more" where several objects' matter was joined.
std::string names_of(const std::vector<ObjectId>& owners, const std::vector<StoreObject>& objects);

}  // namespace pvsfarm

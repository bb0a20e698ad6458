// What a bake is: equal digests mean equal bytes of the store.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/digest.hpp"
#include "common/cells/cell_source.hpp"
#include "common/pvs/settings.hpp"

namespace pvsfarm {

// Of scene, cells with their ids, settings and algorithm version. The version of Mesa, where it
// draws, is not in it: the journal pins that, and the store's settings name it.
Digest bake_digest_of(const Digest& scene, const std::vector<RootCell>& roots,
                      const BakeSettings& settings);

// In one line, all of them; `kernel` may be "".
std::string settings_json(const BakeSettings& settings, const std::string& kernel);
// Exactly the settings that were written; none if `text` lacks one or holds what is none.
std::optional<BakeSettings> settings_from_json(const std::string& text);

}  // namespace pvsfarm

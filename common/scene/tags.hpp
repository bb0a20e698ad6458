// The tags file: {"objects":[{"name":..,"occluder":..,"occludee":..,"dynamic":..}, ..]}, one entry
// an object of the scene file, in its order; absent flags keep what the scene file says.
#pragma once

#include <span>
#include <string>

#include "common/base/result.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm {

// `occluder` can only be taken away: alpha-tested and blended objects never occlude.
// Errors: kInvalidInput (no such file, not the format, wrong count, a name that does not match).
Status apply_tags(const std::string& path, std::span<SourceObject> objects);

}  // namespace pvsfarm

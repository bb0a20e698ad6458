// Which glTF extensions a file needs, and whether the reader can do without guessing.
#pragma once

#include <string>

#include "common/base/result.hpp"

namespace pvsfarm {

// Requires: `path` ends in .gltf or .glb and can be read.
// Errors: kUnsupported for an extension that would lose or garble geometry, kInvalidInput for a
// file whose JSON cannot be read.
Status check_gltf_extensions(const std::string& path);

}  // namespace pvsfarm

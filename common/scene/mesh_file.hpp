// One mesh file read through assimp, the only place that knows it.
//
// assimp holds coordinates as floats: a file gains nothing from more digits than that. Nothing
// more is lost here: transforms are applied in double.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm {

struct MeshFile {
  std::vector<SourceObject> objects;  // z up, one a mesh node, in file order
  UpAxis up = UpAxis::kZ;
  std::size_t animated_objects = 0;   // marked dynamic: their boxes hold only the rest pose
};

// `up` empty: y for glTF and GLB, z for the rest.
// Errors: kInvalidInput (missing, unreadable, broken), kUnsupported; the text names the file.
Result<MeshFile> read_mesh_file(const std::string& path, std::optional<UpAxis> up);

}  // namespace pvsfarm

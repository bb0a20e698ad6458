// Reads scene files through assimp: glTF, GLB, OBJ, PLY.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/result.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm {

struct ImportOptions {
  std::string scene_path;
  std::optional<UpAxis> up = {};  // default: y for glTF and GLB, z for the rest
  std::string tags_path = {};     // "" for none; {"objects":[{"name","occluder", ...}]}
  std::string occluders_path = {};  // "" for none; geometry that only occludes
};

struct ImportedScene {
  SceneSource source;
  std::vector<std::string> warnings;  // one line each, for the user
};

// One object per mesh node (OBJ: per `o`/`g`), names kept, in file order.
// Errors: kInvalidInput (missing, unreadable, broken mesh, NaN, empty, tags that do not fit),
// kUnsupported (a required extension), one line that names file and place and how to mend it.
Result<ImportedScene> import_scene(const ImportOptions& options);

}  // namespace pvsfarm

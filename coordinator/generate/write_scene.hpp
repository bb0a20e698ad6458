// Writes a generated scene as files that `bake` reads: NAME.obj or NAME.glb, and beside it
// NAME.cells.json and NAME.tags.json.
#pragma once

#include <string>

#include "common/base/result.hpp"
#include "coordinator/generate/generated_scene.hpp"

namespace pvsfarm {

// `path` ends in .obj or .glb. All three files appear, whole, or none does.
// Errors: kCommandLine (another ending), kIo, kUnsupported (larger than a GLB file can be).
Status write_scene(const GeneratedScene& scene, const std::string& path);

// The contents of the files.
// OBJ: z up, one `o` an object; every coordinate is written so that it reads back bit for bit.
std::string obj_text(const SceneSource& source);
// glTF 2.0 binary: y up, one node and mesh an object, float32 (exact for generated scenes), two
// materials (double-sided or not), object flags that are not the default as node `extras`.
Result<std::string> glb_bytes(const SceneSource& source);
std::string cells_json(const std::vector<RootCell>& cells);  // axis-aligned cells only
std::string tags_json(const SceneSource& source);

}  // namespace pvsfarm

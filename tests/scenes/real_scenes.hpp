// The scenes that soundness is judged on at full size: generated ones, and those in the folder
// that the environment names.
#pragma once

#include <string>
#include <vector>

#include "common/base/result.hpp"
#include "common/cells/cell.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm {

struct NamedScene {
  std::string name;
  std::string folder;  // scene.obj, cells.json, tags.json, perhaps blockers.obj; "": generated
};

// Small members of every generated family.
std::vector<NamedScene> generated_scenes();
// Each folder with a scene.obj below PVSFARM_SCENES, or below ../shared/scenes beside the checkout;
// none where there is no such place.
std::vector<NamedScene> scenes_on_disk();

struct SceneWithCells {
  SceneSource source;
  std::vector<Cell> cells;
};
// Errors: those of the generators, of import_scene and read_cells.
Result<SceneWithCells> load(const NamedScene& scene);

}  // namespace pvsfarm

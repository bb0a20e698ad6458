// The scene that a store was baked from, read again: for the commands that need both.
#pragma once

#include <memory>
#include <string>

#include "common/base/result.hpp"
#include "common/pvs/settings.hpp"
#include "common/pvs/store_reader.hpp"
#include "common/scene/scene.hpp"

namespace CLI {
class App;
}

namespace pvsfarm {

struct StoreSceneOptions {
  std::string store, scene;
  std::string tags, occluders, up;  // "" for none
};

// Declares `store`, `scene` and what else the bake was told of the scene.
void add_store_scene_options(CLI::App& command, StoreSceneOptions& options);

// Errors: kInvalidInput, also if it is not the scene that the store was baked from.
Result<std::shared_ptr<const Scene>> read_scene_of(const StoreReader& store,
                                                   const StoreSceneOptions& options);

// Errors: kInvalidInput (the store does not tell them all).
Result<BakeSettings> read_settings_of(const StoreReader& store);

}  // namespace pvsfarm

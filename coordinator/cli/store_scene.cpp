#include "coordinator/cli/store_scene.hpp"

#include <CLI/CLI.hpp>

#include "common/base/log.hpp"
#include "common/scene/import.hpp"
#include "common/scene/scene_build.hpp"
#include "coordinator/service/bake_identity.hpp"

namespace pvsfarm {

void add_store_scene_options(CLI::App& command, StoreSceneOptions& options) {
  command.add_option("store", options.store, "the .pvs file")->required();
  command.add_option("scene", options.scene, "the scene it was baked from")->required();
  command.add_option("--tags", options.tags, "as for the bake");
  command.add_option("--occluders", options.occluders, "as for the bake");
  command.add_option("--up", options.up, "as for the bake: y or z")
      ->check(CLI::IsMember({"y", "z"}));
}

Result<std::shared_ptr<const Scene>> read_scene_of(const StoreReader& store,
                                                   const StoreSceneOptions& options) {
  ImportOptions import{.scene_path = options.scene,
                       .up = std::nullopt,
                       .tags_path = options.tags,
                       .occluders_path = options.occluders};
  if (!options.up.empty()) import.up = options.up == "y" ? UpAxis::kY : UpAxis::kZ;
  auto imported = import_scene(import);
  if (!imported) return imported.error();
  auto scene = build_scene(std::move(imported->source));
  if (!scene) return invalid_input(options.scene + ": " + scene.error().text);
  if ((*scene)->digest() != store.header().scene_digest)
    return invalid_input(options.scene + ": not the scene of " + store.path() +
                         ", or not with the --tags, --occluders and --up it was baked with");
  return scene;
}

Result<BakeSettings> read_settings_of(const StoreReader& store) {
  const auto settings = settings_from_json(store.header().settings_json);
  if (!settings)
    return invalid_input(store.path() +
                         ": does not tell all the settings of its bake; bake it with this version "
                         "of pvsfarm");
  return *settings;
}

}  // namespace pvsfarm

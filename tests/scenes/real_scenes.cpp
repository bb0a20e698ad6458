#include "tests/scenes/real_scenes.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "common/cells/cell_source.hpp"
#include "common/scene/import.hpp"
#include "coordinator/generate/generate.hpp"

namespace pvsfarm {
namespace {

namespace fs = std::filesystem;

Result<GeneratedScene> generate(const std::string& name) {
  if (name == "city") return generate_city({.blocks = 5});
  if (name == "closed_city") return generate_closed_city({.blocks = 4});
  if (name == "forest") return generate_forest({.trees = 400, .leaves = 60});
  if (name == "rooms") return generate_rooms({.rooms = 6});
  if (name == "terrain") return generate_terrain({.tiles = 5});
  PVS_CHECK_EQ(name, "maze");
  return generate_maze({.size = 12});
}

std::vector<Cell> cells_of(const std::vector<RootCell>& roots) {
  std::vector<Cell> cells;
  for (const RootCell& root : roots) cells.push_back(root.cell);
  return cells;
}

}  // namespace

std::vector<NamedScene> generated_scenes() {
  return {{"city", ""},  {"closed_city", ""}, {"forest", ""},
          {"rooms", ""}, {"terrain", ""},     {"maze", ""}};
}

std::vector<NamedScene> scenes_on_disk() {
  const char* place = std::getenv("PVSFARM_SCENES");
  const fs::path root =
      place != nullptr ? fs::path(place) : fs::path(PVSFARM_SOURCE_DIR) / ".." / "shared/scenes";
  std::vector<NamedScene> scenes;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(root, none))
    if (fs::exists(entry.path() / "scene.obj"))
      scenes.push_back({entry.path().filename().string(), entry.path().string()});
  std::sort(scenes.begin(), scenes.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  return scenes;
}

Result<SceneWithCells> load(const NamedScene& scene) {
  if (scene.folder.empty()) {
    auto made = generate(scene.name);
    if (!made.ok()) return made.error();
    return SceneWithCells{std::move(made->source), cells_of(made->cells)};
  }
  const fs::path folder = scene.folder;
  const auto if_there = [&](const char* name) {
    return fs::exists(folder / name) ? (folder / name).string() : std::string();
  };
  auto imported = import_scene({.scene_path = (folder / "scene.obj").string(),
                                .up = {},
                                .tags_path = if_there("tags.json"),
                                .occluders_path = if_there("blockers.obj")});
  if (!imported.ok()) return imported.error();
  auto cells = read_cells((folder / "cells.json").string());
  if (!cells.ok()) return cells.error();
  return SceneWithCells{std::move(imported->source), cells_of(*cells)};
}

}  // namespace pvsfarm

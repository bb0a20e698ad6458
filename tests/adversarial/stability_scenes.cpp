#include "tests/adversarial/stability_scenes.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/base/check.hpp"
#include "coordinator/generate/generate.hpp"
#include "tests/property/random_scenes.hpp"
#include "tests/support/make_objects.hpp"

namespace pvsfarm {
namespace {

// Random worlds of metres around the origin that hide about half of what is in them.
struct RandomScene {
  Family family;
  std::uint64_t seed;
};
constexpr RandomScene kRandomScenes[] = {
    {Family::kBlocks, 18}, {Family::kPlates, 7}, {Family::kSlits, 32},   {Family::kStraddle, 13},
    {Family::kMeshes, 41}, {Family::kRooms, 45}, {Family::kTouching, 7},
};

// A metre at eye height around the origin.
const Cell kStandingCell = Cell::aligned({{-0.5, -0.5, 1.5}, {0.5, 0.5, 1.875}});

// Things on the ground, in rows beyond x = `near`.
void add_things(SceneSource& source, double near) {
  for (int row = 0; row < 3; ++row)
    for (int k = -3; k <= 3; ++k) {
      const Vec3 at{near + 2 + 4.0 * row, 3.0 * k, 0};
      source.objects.push_back(box_object("thing " + std::to_string(row) + " " + std::to_string(k),
                                          {at, at + Vec3{1, 1, 1.0 + row}}, Role::kOnlyOccluded));
    }
}

SceneSource things_behind_a_wall() {
  SceneSource source;
  source.objects = {box_object("wall", {{5, -20, 0}, {5.25, 20, 8}})};
  add_things(source, 5.25);
  return source;
}

SceneSource things_behind_a_row_of_houses() {
  SceneSource source;
  double y = -24;
  for (const auto& [wide, deep, high] :
       {std::tuple(10, 8, 9), {12, 8, 14}, {9, 6, 11}, {17, 8, 10}}) {
    source.objects.push_back(box_object("house " + std::to_string(source.objects.size()),
                                        {{6, y, 0}, {6.0 + deep, y + wide, 1.0 * high}}));
    y += wide;
  }
  add_things(source, 14);
  return source;
}

// An upright prism over a regular polygon, closed.
SourceObject tower(const Vec3& middle, double radius, double height, std::uint32_t sides) {
  SourceObject tower;
  tower.name = "tower";
  for (const double z : {0.0, height})
    for (std::uint32_t k = 0; k < sides; ++k) {
      const double angle = 2 * std::numbers::pi * k / sides;
      tower.vertices.push_back(middle +
                               Vec3{radius * std::cos(angle), radius * std::sin(angle), z});
    }
  for (std::uint32_t k = 0; k < sides; ++k) {
    const std::uint32_t next = (k + 1) % sides;
    tower.triangles.push_back({k, next, sides + next});
    tower.triangles.push_back({k, sides + next, sides + k});
    if (k < 2) continue;
    tower.triangles.push_back({0, k, k - 1});
    tower.triangles.push_back({sides, sides + k - 1, sides + k});
  }
  return tower;
}

SceneSource things_behind_a_tower() {
  SceneSource source;
  source.objects = {tower({12, 0, 0}, 6, 12, 8)};
  add_things(source, 18);
  return source;
}

// Four walls around the viewer, their corners closed, and things outside.
SceneSource things_outside_a_yard() {
  SceneSource source;
  const double in = 6, out = 6.5, high = 7;
  source.objects = {box_object("east", {{in, -out, 0}, {out, out, high}}),
                    box_object("west", {{-out, -out, 0}, {-in, out, high}}),
                    box_object("south", {{-in, -out, 0}, {in, -in, high}}),
                    box_object("north", {{-in, in, 0}, {in, out, high}})};
  add_things(source, 7);
  return source;
}

std::vector<Cell> cells_of(const GeneratedScene& scene, std::size_t count) {
  std::vector<Cell> cells;
  count = std::min(count, scene.cells.size());
  for (std::size_t k = 0; k < count; ++k)
    cells.push_back(scene.cells[(2 * k + 1) * scene.cells.size() / (2 * count)].cell);
  return cells;
}

}  // namespace

std::vector<StabilityScene> stability_scenes(const StabilitySize& size) {
  std::vector<StabilityScene> scenes;
  const auto add = [&scenes](std::string name, SceneKind kind, SceneSource source,
                             std::vector<Cell> cells) {
    scenes.push_back({std::move(name), kind, world_of(std::move(source), std::move(cells))});
  };
  add("wall", SceneKind::kTiny, things_behind_a_wall(), {kStandingCell});
  add("row of houses", SceneKind::kTiny, things_behind_a_row_of_houses(), {kStandingCell});
  add("tower", SceneKind::kTiny, things_behind_a_tower(), {kStandingCell});
  add("yard", SceneKind::kTiny, things_outside_a_yard(), {kStandingCell});

  for (const auto& [family, seed] : kRandomScenes) {
    RandomWorld random = random_world(family, seed);
    random.cells.resize(std::min(random.cells.size(), size.cells));
    add(std::string("random ") + to_string(family), SceneKind::kRandom, std::move(random.source),
        std::move(random.cells));
  }

  const auto generated = [&](std::string name, Result<GeneratedScene> scene) {
    PVS_CHECK(scene.ok());
    std::vector<Cell> cells = cells_of(*scene, size.cells);
    add(std::move(name), SceneKind::kGenerated, std::move(scene->source), std::move(cells));
  };
  generated("city", generate_city({.blocks = 2}));
  generated("closed city", generate_closed_city({.blocks = 2}));
  generated("rooms", generate_rooms({.rooms = size.rooms}));
  generated("terrain", generate_terrain({.tiles = 2}));
  generated("maze", generate_maze({.size = 8}));
  return scenes;
}

}  // namespace pvsfarm

// Where grid_cells finds a place to stand.
#include <gtest/gtest.h>

#include "common/cells/cell_source.hpp"
#include "common/scene/scene_build.hpp"
#include "coordinator/generate/generate.hpp"
#include "coordinator/generate/mesh_kit.hpp"

namespace pvsfarm {
namespace {

std::vector<Box> grid_over(const SceneSource& source, const GridRequest& request) {
  const auto scene = build_scene(source);
  EXPECT_TRUE(scene.ok());
  const auto cells = grid_cells(**scene, request);
  EXPECT_TRUE(cells.ok()) << (cells.ok() ? "" : cells.error().text);
  std::vector<Box> boxes;
  for (const RootCell& root : *cells) {
    EXPECT_EQ(root.id, static_cast<std::int64_t>(boxes.size()));
    boxes.push_back({root.cell.lo, root.cell.hi});
  }
  return boxes;
}

bool any_holds(const std::vector<Box>& boxes, const Vec3& p) {
  for (const Box& box : boxes)
    if (box.contains(p)) return true;
  return false;
}

SourceObject floor_of(const Box& box) {
  SourceObject floor{.name = "floor"};
  add_ground(floor, box, 1000);
  return floor;
}

TEST(GridCells, hold_every_eye_over_a_flat_floor_and_share_their_borders) {
  const std::vector<Box> cells =
      grid_over({{floor_of({{0, 0, 3}, {40, 20, 3}})}}, {.size = 5, .height = 0.4});
  EXPECT_EQ(cells.size(), 8u * 4u);
  for (double y = 1; y <= 19; y += 0.5)
    for (double x = 1; x <= 39; x += 0.5)
      for (const double z : {4.5, 4.9}) ASSERT_TRUE(any_holds(cells, {x, y, z})) << x << ' ' << y;
  for (const Box& cell : cells) {
    EXPECT_GT(cell.lo.z, 3);
    EXPECT_LE(cell.size().z, 0.4 + 0.2 + 1e-6);
    if (cell.hi.x < 39) {
      EXPECT_EQ(std::fmod(cell.hi.x, 5), 0);
    }
  }
}

TEST(GridCells, keep_clear_of_walls_and_of_what_is_too_low_to_stand_under) {
  SceneSource source{{floor_of({{0, 0, 0}, {20, 20, 0}})}};
  const Box wall{{9, 0, 0}, {11, 20, 3}}, shelf{{0, 10, 1.2}, {9, 20, 1.4}};
  source.objects.push_back(box_object("wall", wall));
  source.objects.push_back(box_object("shelf", shelf));
  for (const Box& cell : grid_over(source, {.size = 2})) {
    EXPECT_FALSE(cell.meets(wall));
    EXPECT_FALSE(cell.lo.z < 2 && cell.lo.x < 8.5 && cell.hi.y > 10)
        << cell.lo.x << ' ' << cell.hi.y;
  }
}

TEST(GridCells, give_every_storey_its_own_and_the_roof_none) {
  SceneSource source;
  for (const double z : {0.0, 3.0, 6.0})
    source.objects.push_back(floor_of({{0, 0, z}, {10, 10, z}}));
  const std::vector<Box> cells = grid_over(source, {.size = 5});
  EXPECT_EQ(cells.size(), 8u);
  EXPECT_TRUE(any_holds(cells, {5, 5, 1.7}));
  EXPECT_TRUE(any_holds(cells, {5, 5, 4.7}));
  EXPECT_FALSE(any_holds(cells, {5, 5, 3.0}));
  EXPECT_FALSE(any_holds(cells, {5, 5, 7.7}));
}

TEST(GridCells, of_rooms_lie_in_every_room_and_none_on_the_roof) {
  const GeneratedScene rooms = generate_rooms({.rooms = 4}).value();
  const std::vector<Box> cells = grid_over(rooms.source, {.size = 5});
  for (const Box& cell : cells) EXPECT_LT(cell.hi.z, 3);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x) {
      const Box room{{x * 6.0 + 1, y * 5.0 + 1, 1.6}, {x * 6.0 + 5, y * 5.0 + 4, 1.8}};
      bool met = false;
      for (const Box& cell : cells) met = met || cell.meets(room);
      EXPECT_TRUE(met) << "room " << x << ' ' << y;
    }
}

TEST(GridCells, stand_on_a_deck_that_stairs_lead_to) {
  SceneSource source{{floor_of({{0, 0, 0}, {30, 20, 0}})}};
  source.objects.push_back(box_object("deck", {{20, 5, 0}, {30, 15, 3}}));
  for (int i = 1; i < 10; ++i)  // steps of 0.3 m
    source.objects.push_back(
        box_object(numbered("step", {i}), {{20.0 - 10 + i, 8, 0}, {21.0 - 10 + i, 12, 0.3 * i}}));
  EXPECT_TRUE(any_holds(grid_over(source, {.size = 2}), {26, 10, 4.7}));
}

TEST(GridCells, follow_a_slope) {
  SourceObject ramp{.name = "ramp"};
  ramp.vertices = {{0, 0, 0}, {40, 0, 10}, {40, 10, 10}, {0, 10, 0}};
  ramp.triangles = {{0, 1, 2}, {0, 2, 3}};
  const std::vector<Box> cells = grid_over({{ramp}}, {.size = 5});
  for (double x = 1.5; x < 38.5; x += 0.25)
    EXPECT_TRUE(any_holds(cells, {x, 5, x / 4 + kEyeLow_m + 0.2})) << x;
}

TEST(GridCells, leave_out_slopes_too_steep_to_stand_on) {
  SourceObject cliff{.name = "cliff"};
  cliff.vertices = {{20, 0, 0}, {30, 0, 20}, {30, 20, 20}, {20, 20, 0}};
  cliff.triangles = {{0, 1, 2}, {0, 2, 3}};
  const std::vector<Box> cells =
      grid_over({{floor_of({{0, 0, 0}, {20, 20, 0}}), cliff}}, {.size = 2});
  EXPECT_TRUE(any_holds(cells, {10, 10, 1.7}));
  for (const Box& cell : cells) EXPECT_LT(cell.lo.x, 22);
}

TEST(GridCells, of_a_city_hold_every_eye_in_its_streets_and_stand_on_no_roof) {
  const GeneratedScene city = generate_city({.blocks = 2}).value();
  const std::vector<Box> cells = grid_over(city.source, {.size = 5});
  for (const Box& cell : cells) EXPECT_LT(cell.hi.z, 9) << "a cell on a roof";

  std::vector<Box> obstacles;
  for (const SourceObject& object : city.source.objects) {
    if (object.name.starts_with("ground")) continue;
    obstacles.emplace_back();
    for (const Vec3& v : object.vertices) obstacles.back().add(v);
  }
  // A voxel of half a metre and as much of a person's radius.
  const Vec3 clearance{1.25, 1.25, 0};
  Random random(11);
  int free_places = 0;
  for (const RootCell& root : city.cells) {  // they tile the streets
    const Vec3 eye{random.between(root.cell.lo.x, root.cell.hi.x),
                   random.between(root.cell.lo.y, root.cell.hi.y), 1.7};
    const Vec3 foot{eye.x, eye.y, 0};
    const Box around{foot - clearance, foot + clearance};
    bool free = eye.x > 2 && eye.y > 2 && eye.x < 160 && eye.y < 160;
    for (const Box& obstacle : obstacles) free = free && !obstacle.meets(around);
    if (!free) continue;
    ++free_places;
    EXPECT_TRUE(any_holds(cells, eye)) << eye.x << ' ' << eye.y;
  }
  EXPECT_GT(free_places, 100);
}

// A floor that runs on under a closed box is no hall, however large the box.
TEST(GridCells, never_stand_inside_a_box_nor_on_it) {
  SceneSource source{{floor_of({{0, 0, 0}, {60, 60, 0}})}};
  const Box hall{{10, 10, 0}, {50, 50, 12}};
  source.objects.push_back(box_object("hall", hall));
  const std::vector<Box> cells = grid_over(source, {.size = 2});
  for (const Box& cell : cells) {
    EXPECT_FALSE(hall.contains(cell.center()));
    EXPECT_LT(cell.hi.z, 12) << "on its roof";
  }
}

TEST(GridCells, are_refused_where_they_would_be_a_billion) {
  const auto scene = build_scene({{floor_of({{0, 0, 0}, {1500, 1500, 0}})}});
  const auto cells = grid_cells(**scene, {.size = 0.01});
  ASSERT_FALSE(cells.ok());
  EXPECT_EQ(cells.error().kind, ErrorKind::kInvalidInput);
  EXPECT_NE(cells.error().text.find("larger SIZE"), std::string::npos);
}

TEST(GridCells, are_refused_where_no_one_can_stand) {
  SourceObject wall{.name = "wall"};
  wall.vertices = {{0, 0, 0}, {10, 0, 0}, {10, 0, 10}};
  wall.triangles = {{0, 1, 2}};
  const auto scene = build_scene({{wall}});
  const auto cells = grid_cells(**scene, {.size = 1});
  ASSERT_FALSE(cells.ok());
  EXPECT_EQ(cells.error().kind, ErrorKind::kInvalidInput);
  EXPECT_NE(cells.error().text.find("axis up"), std::string::npos);
}

}  // namespace
}  // namespace pvsfarm

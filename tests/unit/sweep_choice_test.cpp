// Where the cascade sweeps of its own accord: in thickets, in the Projections' place; not in
// cities, unless everything is asked for.
#include <gtest/gtest.h>

#include "common/scene/scene_build.hpp"
#include "coordinator/generate/generate.hpp"
#include "tests/support/make_objects.hpp"
#include "worker/evaluator/evaluator.hpp"
#include "worker/evaluator/sweep_choice.hpp"

namespace pvsfarm {
namespace {

constexpr Methods kWithSweep = kDefaultMethods;
constexpr Methods kWithoutSweep =
    Methods::from_bits(kDefaultMethods.bits() & ~Methods{Method::kSweep, Method::kShafts}.bits());

// Ticks whenever it is looked at, so that a method that had its turn took time.
double ticks() {
  static double now = 0;
  return ++now;
}
bool had_its_turn(const CellDelta& delta, Method method) {
  return delta.statistics.methods[static_cast<std::size_t>(method)].cpu_ms > 0;
}

struct Place {
  explicit Place(Result<GeneratedScene> made) {
    PVS_CHECK(made.ok());
    cell = made->cells.front().cell;
    const auto built = build_scene(made->source);
    PVS_CHECK(built.ok());
    scene = *built;
  }
  CellDelta evaluate(Methods methods, double gap) const {
    EvaluatorSettings settings;
    settings.methods = methods;
    settings.gap = gap;
    return Evaluator(scene, settings, ticks).evaluate({0, 1}, cell, all_occludees(*scene));
  }
  std::shared_ptr<const Scene> scene;
  Cell cell;
};

TEST(OccluderWidths, count_by_area_and_by_the_second_longest_side) {
  SceneSource source;
  // Four plates of 1 x 2, one wall of 4 x 8: areas of 8 and 32.
  for (int i = 0; i < 4; ++i) {
    const Vec3 lo{10.0 * i, 0, 0};
    source.objects.push_back(box_object("plate", {lo, lo + Vec3{1, 0.01, 2}}));
  }
  source.objects.push_back(box_object("wall", {{0, 50, 0}, {8, 50.01, 4}}));
  const auto scene = build_scene(source);
  ASSERT_TRUE(scene.ok());
  const OccluderWidths widths = OccluderWidths::of_pieces(**scene);
  EXPECT_EQ(widths.share_narrower_than(0.5), 0);
  EXPECT_DOUBLE_EQ(widths.share_narrower_than(2), 0.2);
  EXPECT_DOUBLE_EQ(widths.share_narrower_than(100), 1);
  EXPECT_EQ(widths.share_narrower_than(0), 0);
  EXPECT_FALSE(all_narrow(widths, Cell::aligned({{0, -5, 0}, {3, -2, 2}})));
  EXPECT_TRUE(all_narrow(widths, Cell::aligned({{0, -9, 0}, {3, -2, 2}})));
}

TEST(OccluderWidths, of_a_scene_without_occluders_say_nothing) {
  SceneSource source;
  source.objects.push_back(box_object("leaf", {{0, 0, 0}, {1, 1, 1}}, Role::kOnlyOccluded));
  const auto scene = build_scene(source);
  ASSERT_TRUE(scene.ok());
  EXPECT_EQ(OccluderWidths::of_pieces(**scene).share_narrower_than(100), 0);
}

// A hall of tiles: none of its pieces is as wide as the cell, but all of them are one surface.
TEST(SweepChoice, wide_cells_between_walls_of_small_tiles_get_shafts) {
  constexpr int kTiles = 16;
  SourceObject wall = box_object("wall", {{-1, -1, -1}, {1, 1, 1}});
  wall.vertices.clear();
  wall.triangles.clear();
  for (int j = 0; j <= kTiles; ++j)  // bulging, so that no two tiles are one piece
    for (int i = 0; i <= kTiles; ++i)
      wall.vertices.push_back({10.0 * i - 80, 20 + 0.1 * ((i * i + 3 * j * j) % 7), 10.0 * j - 80});
  for (std::uint32_t j = 0; j < kTiles; ++j)
    for (std::uint32_t i = 0; i < kTiles; ++i) {
      const std::uint32_t a = j * (kTiles + 1) + i, b = a + kTiles + 1;
      wall.triangles.push_back({a, a + 1, b});
      wall.triangles.push_back({b, a + 1, b + 1});
    }
  wall.two_sided = true;
  SceneSource source;
  source.objects = {wall, box_object("behind", {{-1, 30, -1}, {1, 31, 1}}, Role::kOnlyOccluded)};
  const auto scene = build_scene(source);
  ASSERT_TRUE(scene.ok());
  const Cell cell = Cell::aligned({{-9, -9, -2}, {9, 9, 2}});
  EXPECT_TRUE(all_narrow(OccluderWidths::of_pieces(**scene), cell));
  EXPECT_FALSE(all_narrow(OccluderWidths::of_surfaces(**scene), cell));
  EvaluatorSettings settings;
  settings.max_rays = 0;
  const CellDelta delta =
      Evaluator(*scene, settings, ticks).evaluate({0, 1}, cell, all_occludees(**scene));
  EXPECT_TRUE(had_its_turn(delta, Method::kSweep));
  EXPECT_TRUE(had_its_turn(delta, Method::kShafts));
  EXPECT_EQ(delta.hidden.count(), 1u);
}

TEST(SweepChoice, in_a_thicket_the_sweep_stands_in_for_projections) {
  const Place place(generate_forest({.trees = 400, .leaves = 1000, .cell_size = 2, .glades = 4}));
  const CellDelta by_projections = place.evaluate(kWithoutSweep, 0.1);
  const CellDelta chosen = place.evaluate(kWithSweep, 0.1);
  EXPECT_EQ(by_projections.hidden.count(), 0u);
  EXPECT_GT(chosen.hidden.count(), 150u);
  EXPECT_FALSE(had_its_turn(chosen, Method::kProjection));
  EXPECT_FALSE(had_its_turn(chosen, Method::kFineProjection));
  EXPECT_GT(chosen.seen.count(), 0u);
}

TEST(SweepChoice, where_the_sweep_settles_too_little_projections_have_their_turn) {
  // Leaves so few that nothing fuses.
  const Place place(
      generate_forest({.trees = 200, .leaves = 10, .cell_size = 2, .glades = 3, .leaf_size = 0.5}));
  // Nor would witnesses leave anything open.
  const CellDelta delta =
      place.evaluate({Method::kProjection, Method::kFineProjection, Method::kSweep}, 0.1);
  EXPECT_TRUE(had_its_turn(delta, Method::kSweep));
  EXPECT_TRUE(had_its_turn(delta, Method::kProjection));
}

TEST(SweepChoice, a_city_is_not_swept_unless_everything_is_asked_for) {
  const Place place(generate_city({.blocks = 4}));
  const CellDelta without = place.evaluate(kWithoutSweep, 0.01);
  const CellDelta with = place.evaluate(kWithSweep, 0.01);
  EXPECT_FALSE(had_its_turn(with, Method::kSweep));
  EXPECT_TRUE(with.hidden == without.hidden);
  EXPECT_TRUE(with.seen == without.seen);
  EXPECT_TRUE(had_its_turn(place.evaluate(kWithSweep, 0), Method::kSweep));
}

TEST(SweepChoice, alone_it_is_always_made) {
  const Place place(generate_city({.blocks = 4}));
  EXPECT_TRUE(had_its_turn(place.evaluate({Method::kSweep}, 0.1), Method::kSweep));
}

}  // namespace
}  // namespace pvsfarm

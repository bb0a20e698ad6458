// A city that stands askew to the axes of its file, with cells that follow its streets, is the same
// city: only rounding may tell its visible sets from those of the city before it was turned.
#include <gtest/gtest.h>

#include "coordinator/generate/generate.hpp"
#include "coordinator/generate/placement.hpp"
#include "tests/adversarial/stability.hpp"
#include "tests/support/evaluation.hpp"
#include "tests/support/make_objects.hpp"

namespace pvsfarm {
namespace {

constexpr int kHouses = 9;
constexpr double kPitch_m = 20;

// Houses and cars on a chessboard of plots. No two houses touch: rows of those that do are merged
// only where they stand along the axes, and that is another matter.
World detached_houses() {
  Random random(5);
  SceneSource source;
  for (int y = 0; y < kHouses; ++y)
    for (int x = 0; x < kHouses; ++x) {
      const Vec3 at{kPitch_m * x, kPitch_m * y, 0};
      const std::string name = std::to_string(x) + "_" + std::to_string(y);
      source.objects.push_back(
          box_object("house" + name, {at, at + Vec3(13, 11, random.between(6, 15))}));
      source.objects.push_back(
          box_object("car" + name, {at + Vec3(14, 2, 0), at + Vec3(16, 6, 1.4)}));
    }
  std::vector<Cell> cells;
  for (const int k : {0, 3, 4}) {
    const Vec3 at{kPitch_m * k + 14, kPitch_m * k, 1.6};
    cells.push_back(Cell::aligned({at, at + Vec3(5, 5, 0.3)}));  // along y
    const Vec3 crossing{kPitch_m * k + 13.5, kPitch_m * k + 12, 1.6};
    cells.push_back(Cell::aligned({crossing, crossing + Vec3(6, 7, 0.3)}));
  }
  return world_of(std::move(source), std::move(cells));
}

}  // namespace

TEST(TurnedCity, cells_along_its_streets_see_as_little_as_before_it_was_turned) {
  const World world = detached_houses();
  const EvaluatorSettings settings = provers_only(RasterKind::kDirect);
  const VisibleSets straight = evaluate(world, world, settings);
  const std::uint64_t everything = 12 * 2 * kHouses * kHouses * world.cells.size();
  ASSERT_LT(straight.triangles, everything / 2);  // there is something to lose
  std::uint64_t along_streets = 0, along_axes = 0;
  for (const double angle : {0.1, 0.4, 0.785, 1.3}) {
    const World askew = turned(world, frame_about_z(angle));
    const VisibleSets sets = evaluate(askew, world, settings);
    EXPECT_LE(static_cast<double>(sets.triangles), 1.005 * static_cast<double>(straight.triangles))
        << angle;
    // In cells along the axes it is another city.
    World crossed = askew;
    for (std::size_t i = 0; i < crossed.cells.size(); ++i) {
      const Vec3 middle = askew.cells[i].center(), half = world.cells[i].half();
      crossed.cells[i] = Cell::aligned({middle - half, middle + half});
    }
    along_streets += sets.triangles;
    along_axes += evaluate(crossed, world, settings).triangles;
  }
  EXPECT_GT(along_axes, along_streets);
}

std::uint64_t triangles_visible(const GeneratedScene& city, std::size_t step) {
  std::vector<Cell> cells;
  for (std::size_t i = step / 2; i < city.cells.size(); i += step)
    cells.push_back(city.cells[i].cell);
  const World world = world_of(city.source, std::move(cells));
  return evaluate(world, world, provers_only(RasterKind::kDirect)).triangles;
}

// What `generate --rotate --move` makes. Houses that stand wall to wall, in rows that are merged
// only along the axes: askew, a row is so many houses, and what shows between them at a pixel's
// edge is all it costs.
TEST(TurnedCity, a_generated_city_sees_hardly_more_once_it_is_placed_askew_and_far_away) {
  const auto generated = [] { return generate_city({.blocks = 4}).value(); };
  constexpr std::size_t kStep = 150;
  const std::uint64_t straight = triangles_visible(generated(), kStep);
  ASSERT_GT(straight, 0u);
  for (const Placement& placement :
       {Placement{.rotate_deg = 90}, {.rotate_deg = 30}, {30, {450'000, 5'400'000}}}) {
    GeneratedScene city = generated();
    ASSERT_TRUE(place(city, placement));
    const auto askew = static_cast<double>(triangles_visible(city, kStep));
    const auto ratio = askew / static_cast<double>(straight);
    EXPECT_LE(ratio, placement.rotate_deg == 90 ? 1.001 : 1.1) << placement.rotate_deg;
    EXPECT_GE(ratio, 0.9) << placement.rotate_deg;
  }
}

// The frame of a cell far out is as good as that of one at the origin.
TEST(TurnedCity, a_city_far_from_the_origin_is_the_same_city) {
  const World world = detached_houses();
  const EvaluatorSettings settings = provers_only(RasterKind::kDirect);
  const VisibleSets near = evaluate(world, world, settings);
  const World askew = turned(world, frame_about_z(0.4));
  const VisibleSets near_askew = evaluate(askew, world, settings);
  for (const double offset_m : {1e6, 1e7}) {
    const Vec3 offset{offset_m, -offset_m, 0};
    EXPECT_LE(static_cast<double>(evaluate(moved(world, offset), world, settings).triangles),
              1.005 * static_cast<double>(near.triangles))
        << offset_m;
    EXPECT_LE(static_cast<double>(evaluate(moved(askew, offset), world, settings).triangles),
              1.005 * static_cast<double>(near_askew.triangles))
        << offset_m;
  }
}

}  // namespace pvsfarm

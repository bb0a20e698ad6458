// Surfaces between parts of the cell and parts of an object: what is hidden, and what a way past
// the surfaces keeps open.
#include <gtest/gtest.h>

#include "common/base/random.hpp"
#include "tests/support/evaluation.hpp"
#include "tests/unit/surface_shapes.hpp"
#include "worker/evaluator/shaft_prover.hpp"
#include "worker/visibility/shaft.hpp"

namespace pvsfarm {
namespace {

constexpr double kFar = 40;  // walls reach so far: no cell sees past them

// Eyes at y < 0, a wall in y = 4 or so, a small object behind it.
const Cell kCell = Cell::aligned({{-1, -2, 0}, {1, 0, 2}});

SourceObject small_box(double x, double y, double z, double half = 0.25) {
  SourceObject box =
      quads_object("thing", {{Vec3(x - half, y, z - half), Vec3(x + half, y, z - half),
                              Vec3(x + half, y, z + half), Vec3(x - half, y, z + half)}});
  box.occluder = false;
  return box;
}

// Whether the last object of the list is hidden by shafts alone.
bool last_hidden(std::vector<SourceObject> objects, const Cell& cell = kCell, double near_m = 0) {
  SceneSource source;
  source.objects = std::move(objects);
  EvaluatorSettings settings = provers_only(RasterKind::kDirect);
  settings.methods = {Method::kShafts};
  settings.near_m = near_m;
  const auto last = static_cast<std::uint32_t>(source.objects.size() - 1);
  return Evaluation(source, settings).hides(last, cell);
}

// The wall y = `y` as tiles of a metre or two, but for the tile between gap_x0 and gap_x1.
SourceObject tiled_wall(double y, double gap_x0, double gap_x1) {
  return quads_object("wall",
                      {wall(-kFar, gap_x0, y, -kFar, kFar), wall(gap_x1, kFar, y, -kFar, kFar)});
}

TEST(Shaft, HoldsEverySegmentBetweenTheBoxes) {
  Random random(3);
  const auto point_of = [&](const Box& box) {
    return Vec3(random.between(box.lo.x, box.hi.x), random.between(box.lo.y, box.hi.y),
                random.between(box.lo.z, box.hi.z));
  };
  const auto box_within = [&](double reach) {
    Box box;
    for (int k = 0; k < 2; ++k)
      box.add(Vec3(random.between(-reach, reach), random.between(-reach, reach),
                   random.between(-reach, reach)));
    return box;
  };
  int missed = 0;
  for (int trial = 0; trial < 20'000; ++trial) {
    const Box from = box_within(2), to = box_within(10);
    const Shaft shaft(from, to, 1e-12);
    const Vec3 a = point_of(from), b = point_of(to);
    const Vec3 at = a + (b - a) * random.between(0, 1);
    const Vec3 away{random.between(-5, 5), random.between(-5, 5), random.between(-5, 5)};
    EXPECT_FALSE(shaft.misses(at, at + away)) << "trial " << trial;
    EXPECT_FALSE(shaft.misses(at - away, at + away)) << "trial " << trial;
    missed += shaft.misses(at + away, at + away * 1.5) ? 1 : 0;
  }
  EXPECT_GT(missed, 5'000) << "it would hold everything";
}

TEST(Shaft, WhatLiesBeyondOneSideIsMissed) {
  const Shaft shaft({{0, 0, 0}, {1, 1, 1}}, {{10, 9, 0}, {11, 10, 2}}, 1e-9);
  Random random(5);
  constexpr std::size_t kCount = 5'000;
  std::array<std::vector<double>, 6> columns;
  for (auto& column : columns)
    for (std::size_t i = 0; i < kCount; ++i) column.push_back(random.between(-3, 14));
  std::array<const double*, 6> ends;
  for (int k = 0; k < 6; ++k) ends[k] = columns[k].data();
  std::vector<double> beyond(kCount, -1);
  shaft.find_beyond(ends, kCount, beyond.data());
  std::size_t count = 0;
  for (std::size_t i = 0; i < kCount; ++i) {
    const Vec3 a{columns[0][i], columns[1][i], columns[2][i]};
    const Vec3 b{columns[3][i], columns[4][i], columns[5][i]};
    EXPECT_TRUE(beyond[i] == 0 || (beyond[i] == 1 && shaft.misses(a, b))) << i;
    count += beyond[i] == 1 ? 1 : 0;
  }
  EXPECT_GT(count, kCount / 4);
  EXPECT_LT(count, kCount);
}

TEST(Shaft, MissesWhatPassesByTheHullButNotByTheBoxAroundIt) {
  const Shaft shaft({{0, 0, 0}, {1, 1, 1}}, {{10, 10, 0}, {11, 11, 1}}, 1e-9);
  EXPECT_TRUE(shaft.misses({8, 1, 0.5}, {10, 3, 0.5}));
  EXPECT_TRUE(shaft.misses({1, 8, 0.5}, {3, 10, 0.5}));
  EXPECT_FALSE(shaft.misses({1, 8, 0.5}, {8, 1, 0.5}));
}

TEST(Shafts, ASeamIsNoGap) {
  EXPECT_TRUE(last_hidden({tiled_wall(4, 0.1, 0.1), small_box(0, 9, 1)}));
}

TEST(Shafts, ADoorStaysOpen) {
  EXPECT_FALSE(last_hidden({tiled_wall(4, -0.1, 0.1), small_box(0, 9, 1)}));
  EXPECT_FALSE(last_hidden({tiled_wall(4, -0.001, 0.001), small_box(0, 9, 1)}));
}

TEST(Shafts, WhatStandsBesideADoorIsHidden) {
  EXPECT_TRUE(last_hidden({tiled_wall(4, -0.1, 0.1), small_box(9, 6, 1)}));
}

TEST(Shafts, TwoDoorsOutOfLineHideWhatNeitherWallDoes) {
  const std::vector<SourceObject> walls{tiled_wall(4, -1, 1), tiled_wall(5, 5, 7)};
  EXPECT_FALSE(last_hidden({walls[0], small_box(0.5, 12, 1)}));
  EXPECT_TRUE(last_hidden({walls[0], walls[1], small_box(0.5, 12, 1)}));
  EXPECT_TRUE(last_hidden({walls[0], walls[1], small_box(12, 5.5, 1)}));
}

// Each wall blocks what the other lets by for a part of the eyes only: no one choice of triangles
// serves all of the cell.
TEST(Shafts, EyesInPartsOfTheCellAreBlockedByDifferentWalls) {
  const SourceObject left = quads_object("left", {wall(-kFar, 0, 3, -kFar, kFar)});
  const SourceObject right = quads_object("right", {wall(-0.5, kFar, 3.5, -kFar, kFar)});
  EXPECT_TRUE(last_hidden({left, right, small_box(0, 9, 1)}));
  const SourceObject short_right = quads_object("right", {wall(0.5, kFar, 3.5, -kFar, kFar)});
  EXPECT_FALSE(last_hidden({left, short_right, small_box(0.25, 9, 1)}));
}

// One wall stands across the cell, and hides all from the eyes behind it; the others see neither
// through the door nor past it, though those behind would.
TEST(Shafts, AWallAcrossTheCellBlocksForTheEyesBehindIt) {
  const SourceObject across = tiled_wall(-1, 0.1, 0.1), beyond = tiled_wall(4, 3.05, 3.15);
  const SourceObject thing = small_box(5, 9, 1, 0.01);
  EXPECT_FALSE(last_hidden({across, thing}));
  EXPECT_FALSE(last_hidden({beyond, thing}));
  EXPECT_TRUE(last_hidden({across, beyond, thing}));
}

TEST(Shafts, AWallThroughTheObjectHidesNoneOfIt) {
  EXPECT_FALSE(last_hidden(
      {tiled_wall(4, 0.1, 0.1),
       quads_object("thing", {{Vec3(0, 3, 0), Vec3(0, 5, 0), Vec3(0, 5, 1), Vec3(0, 3, 1)}})}));
}

TEST(Shafts, TheNearClipTakesAWayWhatIsNear) {
  EXPECT_TRUE(last_hidden({tiled_wall(4, 0.1, 0.1), small_box(0, 9, 1)}, kCell, 3.9));
  EXPECT_FALSE(last_hidden({tiled_wall(4, 0.1, 0.1), small_box(0, 9, 1)}, kCell, 4.1));
}

TEST(Shafts, AOneSidedWallHidesFromItsFrontOnly) {
  SourceObject towards = tiled_wall(4, 0.1, 0.1);
  towards.two_sided = false;
  SourceObject away = towards;
  for (auto& triangle : away.triangles) std::swap(triangle[1], triangle[2]);
  const bool one = last_hidden({towards, small_box(0, 9, 1)});
  const bool other = last_hidden({away, small_box(0, 9, 1)});
  EXPECT_NE(one, other);
}

// The floor has the height of the cell's lower face, and the wall stands on it: no eye inside the
// cell looks below it.
TEST(Shafts, ACellOnItsFloorBeforeAWallThatStandsOnIt) {
  const SourceObject standing =
      quads_object("wall", {wall(-kFar, 0.1, 4, 0, kFar), wall(0.1, kFar, 4, 0, kFar)});
  SourceObject thing = small_box(0, 9, 0.25);
  EXPECT_TRUE(last_hidden({standing, thing}));
  const Cell lower = Cell::aligned({{-1, -2, -0.1}, {1, 0, 2}});
  SourceObject below = small_box(0, 9, -0.5);
  EXPECT_FALSE(last_hidden({standing, below}, lower));
}

}  // namespace
}  // namespace pvsfarm

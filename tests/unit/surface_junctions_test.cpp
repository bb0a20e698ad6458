// Surfaces where more than two triangles share an edge, or where no front can be given to them:
// which pixels they cover, and that covered pixels keep their promise.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/surface_covered.hpp"

namespace pvsfarm {
namespace {

// Where three walls meet, two of them go on as one, whichever covers: no edge has a neighbour
// named.
TEST(SurfaceJunctions, a_partition_that_runs_into_a_wall_opens_no_seam_there) {
  SourceObject walls = quad({8, -9, -9}, {8, -9, 9}, {8, 0.6, 9}, {8, 0.6, -9});
  append(walls, quad({8, 0.6, -9}, {8, 0.6, 9}, {8, 9, 9}, {8, 9, -9}));
  const int plain = Covered(walls).count();
  for (const double x : {4.0, 12.0}) {
    SourceObject with_partition = walls;
    append(with_partition, quad({8, 0.6, -9}, {8, 0.6, 9}, {x, 0.7, 9}, {x, 0.7, -9}));
    const Covered covered(with_partition);
    EXPECT_GE(covered.count(), plain) << x;
    EXPECT_EQ(covered.broken_promises(), 0);
  }
}

TEST(SurfaceJunctions, four_rooms_around_one_edge_leave_no_leak_there) {
  SourceObject walls = quad({6, 0.1, -9}, {6, 0.1, 9}, {6, 9, 9}, {6, 9, -9});
  append(walls, quad({6, 0.1, -9}, {6, 0.1, 9}, {6, -9, 9}, {6, -9, -9}));
  append(walls, quad({6, 0.1, -9}, {6, 0.1, 9}, {4, 0, 9}, {4, 0, -9}));
  append(walls, quad({6, 0.1, -9}, {6, 0.1, 9}, {9, 0, 9}, {9, 0, -9}));
  const Covered covered(walls);
  for (double y = -1; y <= 1; y += 0.1) EXPECT_TRUE(covered.covers(y, 0)) << y;
  EXPECT_EQ(covered.broken_promises(), 0);
}

TEST(SurfaceJunctions, a_third_wall_at_an_edge_does_not_close_a_door_beside_it) {
  // Two partitions at one end of a wall that is not there: no two of the three are a sheet that
  // covers what lies between.
  SourceObject walls = quad({8, 0, -9}, {8, 0, 9}, {8, -9, 9}, {8, -9, -9});
  append(walls, quad({8, 0, -9}, {8, 0, 9}, {5, 0, 9}, {5, 0, -9}));
  append(walls, quad({8, 0, -9}, {8, 0, 9}, {7, 0.5, 9}, {7, 0.5, -9}));
  const Covered covered(walls);
  EXPECT_TRUE(covered.covers(-3, 0));
  EXPECT_FALSE(covered.covers(3, 0));
  EXPECT_EQ(covered.broken_promises(), 0);
}

// A band with half a turn has no front: neighbours cannot all agree.
TEST(SurfaceJunctions, a_sheet_that_has_no_front_covers_all_the_same) {
  SourceObject band;
  band.name = "band";
  constexpr int kSteps = 12;
  for (int i = 0; i < kSteps; ++i) {
    const double turn = 3.14159265358979 * i / kSteps, around = 2 * turn;
    const double y = 5 * std::cos(around), z = 5 * std::sin(around);
    const double up = 3 * std::cos(turn), along = 3 * std::sin(turn);
    band.vertices.push_back({8 + along, y + up * std::cos(around), z + up * std::sin(around)});
    band.vertices.push_back({8 - along, y - up * std::cos(around), z - up * std::sin(around)});
  }
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    const bool last = i + 1 == kSteps;
    const std::uint32_t a = 2 * i, b = a + 1, c = last ? 1 : a + 2, d = last ? 0 : a + 3;
    band.triangles.push_back({a, b, c});
    band.triangles.push_back({b, d, c});
  }
  const Covered covered(band, 12);
  EXPECT_GT(covered.count(), 100);
  EXPECT_EQ(covered.broken_promises(), 0);
}

TEST(SurfaceJunctions, random_walls_around_common_edges_keep_their_promises) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Random random(seed);
    SourceObject walls;
    walls.name = "walls";
    // Posts in disorder; walls between any two of them.
    std::vector<Vec3> posts;
    for (int i = 0; i < 9; ++i)
      posts.push_back({random.between(1.5, 13), random.between(-8, 8), random.between(5, 9)});
    for (int i = 0; i < 18; ++i) {
      const Vec3 a = posts[random.below(9)], b = posts[random.below(9)];
      if (a == b) continue;
      append(walls, quad({a.x, a.y, -a.z}, a, b, {b.x, b.y, -b.z}));
    }
    EXPECT_EQ(Covered(walls, random.between(2, 12)).broken_promises(20), 0) << "seed " << seed;
  }
}

}  // namespace
}  // namespace pvsfarm

// Whole surfaces as occluders: which pixels they cover, and that every covered pixel keeps its
// promise, for rays from all over the cell to all over the pixel.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/surface_covered.hpp"

namespace pvsfarm {
namespace {

// Squares of `n` x `n` from y, z = -half to half at the given x; none where `open` says so.
template <class Open>
SourceObject wall(double x, double half, int n, Open open) {
  SourceObject object;
  object.name = "wall";
  const double step = 2 * half / n;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double y = -half + i * step, z = -half + j * step;
      if (open(y + step / 2, z + step / 2)) continue;
      append(object, quad({x, y, z}, {x, y, z + step}, {x, y + step, z + step}, {x, y + step, z}));
    }
  return object;
}
const auto kClosed = [](double, double) { return false; };

TEST(SurfaceCover, a_wall_of_small_squares_covers_as_one_square_does) {
  const Covered fine(wall(8, 6, 16, kClosed)), whole(wall(8, 6, 1, kClosed));
  EXPECT_GT(whole.count(), 500);
  EXPECT_EQ(fine.count(), whole.count());
  EXPECT_EQ(fine.broken_promises(), 0);
}

TEST(SurfaceCover, a_door_stays_open_and_the_wall_around_it_closed) {
  const Covered covered(
      wall(8, 6, 16, [](double y, double z) { return std::abs(y - 1.1) < 1 && std::abs(z) < 2; }));
  EXPECT_FALSE(covered.covers(1.1, 0));
  EXPECT_TRUE(covered.covers(-3, 0));
  EXPECT_TRUE(covered.covers(4.5, 0));
  EXPECT_EQ(covered.broken_promises(), 0);
}

TEST(SurfaceCover, two_walls_that_meet_at_an_angle_leave_no_leak_at_their_edge) {
  SourceObject corner = quad({8, 0, -6}, {8, 0, 6}, {5, 6, 6}, {5, 6, -6});
  append(corner, quad({6, -6, -6}, {6, -6, 6}, {8, 0, 6}, {8, 0, -6}));
  const Covered covered(corner);
  for (double y = -1; y <= 1; y += 0.1) EXPECT_TRUE(covered.covers(y, 0)) << y;
  EXPECT_EQ(covered.broken_promises(), 0);
}

TEST(SurfaceCover, walls_torn_by_a_hair_leak_at_the_tear) {
  SourceObject torn = quad({8, 0, -6}, {8, 0, 6}, {8, 6, 6}, {8, 6, -6});
  append(torn, quad({8, -6, -6}, {8, -6, 6}, {8, -1e-6, 6}, {8, -1e-6, -6}));
  EXPECT_FALSE(Covered(torn).covers(0.01, 0));
  EXPECT_EQ(Covered(torn).broken_promises(), 0);
}

TEST(SurfaceCover, a_pillar_does_not_spoil_the_wall_behind_it) {
  const SourceObject plain = wall(8, 6, 4, kClosed);
  SourceObject with_pillar = plain;
  append(with_pillar, quad({4, -0.3, -7}, {4, -0.3, 7}, {4, 0.3, 7}, {4, 0.3, -7}));
  const Covered covered(with_pillar);
  EXPECT_GE(covered.count(), Covered(plain).count());
  EXPECT_EQ(covered.broken_promises(), 0);
}

TEST(SurfaceCover, a_step_that_hangs_together_with_the_wall_spoils_only_where_it_is_seen) {
  // A board out of the wall towards the cell: its rim is border, the wall above is not spoiled.
  SourceObject with_board = wall(8, 6, 4, kClosed);
  append(with_board, quad({8, -6, -3}, {8, 6, -3}, {4, 6, -3}, {4, -6, -3}));
  const Covered covered(with_board);
  EXPECT_TRUE(covered.covers(0, 2));
  EXPECT_EQ(covered.broken_promises(), 0);
}

TEST(SurfaceCover, a_triangle_cut_by_the_plane_covers_only_before_it) {
  // From before the plane at y < 0 to beyond it at y > 0, seen from one side.
  const SourceObject askew = quad({6, -9, -8}, {6, -9, 8}, {14, 9, 8}, {14, 9, -8});
  const Covered covered(askew);
  EXPECT_TRUE(covered.covers(-4, 0));
  EXPECT_FALSE(covered.covers(0.05, 0));
  EXPECT_FALSE(covered.covers(4, 0));
  EXPECT_EQ(covered.broken_promises(), 0);
}

TEST(SurfaceCover, a_floor_that_the_cell_stands_on_covers_what_is_below) {
  SourceObject floor = quad({-3, -40, -1}, {30, -40, -1}, {30, 40, -1}, {-3, 40, -1});
  const Covered touching(floor);
  EXPECT_EQ(touching.chain().triangles.size(), 2u);
  EXPECT_TRUE(touching.covers(0, -3));
  EXPECT_FALSE(touching.covers(0, 0));
  EXPECT_EQ(touching.broken_promises(), 0);

  for (Vec3& p : floor.vertices) p.z = -0.999;  // through the cell
  EXPECT_EQ(Covered(floor).count(), 0);
}

TEST(SurfaceCover, a_floor_that_ends_before_the_cell_does_covers_nothing_at_its_border) {
  const Covered covered(quad({0.5, -40, -1}, {30, -40, -1}, {30, 40, -1}, {0.5, 40, -1}));
  EXPECT_EQ(covered.broken_promises(), 0);
}

TEST(SurfaceCover, a_wall_beside_the_cell_that_ends_there_keeps_its_promises) {
  for (const double x0 : {-4.0, -0.7, 0.0, 0.9, 1.0, 1.02, 1.5}) {
    const Covered covered(quad({x0, 1.3, -9}, {20, 1.3, -9}, {20, 1.3, 9}, {x0, 1.3, 9}));
    EXPECT_EQ(covered.broken_promises(), 0) << x0;
  }
}

TEST(SurfaceCover, a_long_cell_sees_past_a_wall_that_begins_beside_it) {
  const Cell lane = Cell::aligned({{-5, -0.2, -0.2}, {1, 0.2, 0.2}});
  for (const double x0 : {-4.0, -2.0, 0.0, 0.9}) {
    const Covered covered(quad({x0, 1.3, -30}, {30, 1.3, -30}, {30, 1.3, 30}, {x0, 1.3, 30}), 9,
                          lane);
    EXPECT_EQ(covered.broken_promises(), 0) << x0;
  }
}

TEST(SurfaceCover, one_sided_triangles_cover_from_the_front_only) {
  SourceObject front = wall(8, 6, 1, kClosed);
  front.two_sided = false;
  SourceObject back = front;
  for (auto& t : back.triangles) std::swap(t[1], t[2]);
  EXPECT_NE(Covered(front).count() > 0, Covered(back).count() > 0);
}

// The frames of planes before low faces are left-handed: corners turn the other way there.
TEST(SurfaceCover, front_and_back_do_not_change_places_on_the_other_side_of_the_cell) {
  for (const bool turned : {false, true}) {
    SourceObject beyond = wall(8, 6, 1, kClosed), before = wall(-8, 6, 1, kClosed);
    for (SourceObject* object : {&beyond, &before}) {
      object->two_sided = false;
      if (!turned) continue;
      for (auto& t : object->triangles) std::swap(t[1], t[2]);
    }
    EXPECT_NE(Covered(beyond).count() > 0, Covered(before, 9, kCell, 0, Face{0, -1}).count() > 0);
  }
}

TEST(SurfaceCover, what_is_nearer_than_the_near_clip_is_left_out) {
  EXPECT_GT(Covered(wall(2, 6, 1, kClosed), 9, kCell, 0.9).count(), 0);
  EXPECT_EQ(Covered(wall(2, 6, 1, kClosed), 9, kCell, 1.1).count(), 0);
}

TEST(SurfaceCover, depth_is_that_of_what_covers_if_it_ends_before_the_plane) {
  const Covered covered(wall(8, 6, 4, kClosed));
  EXPECT_NEAR(covered.at(0, 0), -2, 1e-5);
  EXPECT_GE(covered.at(0, 0), -2);
}

TEST(SurfaceCover, a_step_in_a_wall_that_turns_its_back_is_no_border) {
  // The wall steps back at y = 0.6, and the step is seen from no eye or edge-on: towards the cell
  // both its edges are border, but the wall as a sheet has none there.
  SourceObject stepped = quad({5, -9, -9}, {5, -9, 9}, {5, 2, 9}, {5, 2, -9});
  append(stepped, quad({5, 2, -9}, {5, 2, 9}, {8, 1.9, 9}, {8, 1.9, -9}));
  append(stepped, quad({8, 1.9, -9}, {8, 1.9, 9}, {8, 12, 9}, {8, 12, -9}));
  const Covered covered(stepped);
  for (double y = -3; y < 7; y += 0.15) EXPECT_TRUE(covered.covers(y, 0)) << y;
  EXPECT_EQ(covered.broken_promises(), 0);
}

TEST(SurfaceCover, a_closed_box_blocks_with_its_front_though_the_crossings_cancel) {
  SourceObject box = box_object("box", {{4, -6, -6}, {8, 6, 6}});
  // Not convex, or it would be left to the solids.
  append(box, box_object("", {{4, 6, -6}, {6, 9, 6}}));
  const Covered covered(box);
  EXPECT_TRUE(covered.covers(0, 0));
  EXPECT_EQ(covered.broken_promises(), 0);
}

TEST(SurfaceCover, one_sided_sheets_keep_their_promises_to_whom_they_show_their_front) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    Random random(seed);
    SourceObject sheet;
    sheet.name = "sheet";
    sheet.two_sided = false;
    for (int i = 0; i < 40; ++i)
      sheet.vertices.push_back(
          {random.between(1.5, 9), random.between(-9, 9), random.between(-9, 9)});
    for (int i = 0; i < 60; ++i) {
      const auto a = static_cast<std::uint32_t>(random.below(38));
      sheet.triangles.push_back(i % 2 == 0 ? std::array<std::uint32_t, 3>{a, a + 1, a + 2}
                                           : std::array<std::uint32_t, 3>{a, a + 2, a + 1});
    }
    EXPECT_EQ(Covered(sheet, random.between(2, 10)).broken_promises(20), 0) << "seed " << seed;
  }
}

TEST(SurfaceCover, random_sheets_keep_their_promises) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Random random(seed);
    // A sheet of triangles over a grid of random heights, with holes, through or before the plane.
    SourceObject sheet;
    sheet.name = "sheet";
    const int n = 6;
    const double reach = random.between(3, 12), at = random.between(-2, 12);
    const double rough = random.between(0, 6), lean = random.between(-1, 1);
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n; ++j)
        sheet.vertices.push_back({at + lean * i + random.between(0, rough),
                                  -reach + 2 * reach * i / n, -reach + 2 * reach * j / n});
    for (std::uint32_t i = 0; i < n; ++i)
      for (std::uint32_t j = 0; j < n; ++j) {
        const std::uint32_t a = i * (n + 1) + j, b = a + n + 1;
        if (random.below(10) > 0) sheet.triangles.push_back({a, b, b + 1});
        if (random.below(10) > 0) sheet.triangles.push_back({a, b + 1, a + 1});
      }
    EXPECT_EQ(Covered(sheet, random.between(1, 12)).broken_promises(20), 0) << "seed " << seed;
  }
}

}  // namespace
}  // namespace pvsfarm

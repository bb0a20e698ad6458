// Hoops as printed: the shadow octree of either table, and the shadow without a rear, colour
// visible space black. Corrected, they do not. All decisions are in integers.
//
//   PVSFARM_SCENES=N   at least N random pairs of hoops, and 20 N random loops
#include <gtest/gtest.h>

#include <iostream>

#include "common/base/random.hpp"
#include "tests/adversarial/reference/hoop_reference.hpp"
#include "tests/adversarial/reference/scene_count.hpp"
#include "tests/support/exact_oracle.hpp"

namespace pvsfarm::reference {
namespace {

using Colour = ShadowOctree::Colour;
constexpr std::uint64_t kPairs = 150;

std::int64_t pick(Random& random, std::int64_t lo, std::int64_t hi) {
  return lo + static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(hi - lo + 1)));
}

ExactPolygon to_polygon(const Loop& loop) {
  std::vector<Vec3> points;
  for (const IntPoint& p : loop) points.push_back(to_vec(p));
  return ExactPolygon(points);
}

// The half-space v[axis] > above.
HalfSpace beyond(int axis, std::int64_t above) {
  HalfSpace h;
  h.p[axis] = h.q[axis] = h.r[axis] = above;
  h.q[(axis + 1) % 3] = 1;
  h.r[(axis + 2) % 3] = 1;
  return h;
}
const IntBox kNode{{{-2, 0, 0}}, {{0, 2, 2}}};

// Case 38.
TEST(HoopTable2AsPrinted, turns_a_node_outside_the_first_plane_black) {
  ShadowOctree printed(kNode, 1, Colour::kWhite), ours = printed;
  const std::vector planes{beyond(0, 0), beyond(1, -2), beyond(2, -2)};
  for (const HalfSpace& plane : planes) printed.update_second(plane);
  EXPECT_EQ(printed.black().size(), 1u);
  ours.add_shadow(planes);
  EXPECT_TRUE(ours.black().empty());
}

// Case 39.
TEST(HoopTable1AsPrinted, forgets_that_a_node_was_outside_when_a_plane_traverses_it) {
  const IntBox node{{{-4, 0, 0}}, {{0, 4, 4}}};
  ShadowOctree printed(node, 1, Colour::kUndetermined), ours(node, 1, Colour::kWhite);
  const std::vector planes{beyond(0, 0), beyond(1, 1)};
  for (const HalfSpace& plane : planes) printed.update_first(plane);
  // Half of its children lie beyond y = 1; none is beyond x = 0.
  EXPECT_EQ(printed.black().size(), 4u);
  ours.add_shadow(planes);
  EXPECT_TRUE(ours.black().empty());
}

TEST(Hoop, shadows_of_two_hoops_are_joined) {
  ShadowOctree tree({{{-4, -4, 0}}, {{4, 4, 8}}}, 3, Colour::kWhite);
  tree.add_shadow({beyond(0, 0), beyond(1, 0)});
  std::int64_t volume = 0;
  tree.add_shadow({beyond(2, 4)});
  for (const IntBox& box : tree.black())
    volume += (box.hi[0] - box.lo[0]) * (box.hi[1] - box.lo[1]) * (box.hi[2] - box.lo[2]);
  // Closed nodes that touch a plane are not beyond it: one layer of unit nodes stays open.
  EXPECT_EQ(volume, 3 * 3 * 8 + 8 * 8 * 3 - 3 * 3 * 3);
}

const IntBox kCell{{{-50, -50, -100}}, {{50, 50, 0}}};

// Case 40.
TEST(Hoop, a_pentagram_turns_left_everywhere_and_is_no_hoop) {
  // The corners of a pentagon of radius 1000, every other one.
  const Loop pentagon{{{1000, 0, 500}},
                      {{309, 951, 500}},
                      {{-809, 588, 500}},
                      {{-809, -588, 500}},
                      {{309, -951, 500}}};
  Loop pentagram;
  for (int k = 0; k < 5; ++k) pentagram.push_back(pentagon[2 * k % 5]);
  EXPECT_TRUE(turns_left(kCell, pentagram));
  EXPECT_FALSE(seen_convex(kCell, pentagram));
  EXPECT_TRUE(seen_convex(kCell, pentagon));
}

bool in_shadow(const IntBox& box, const std::vector<HalfSpace>& half_spaces) {
  for (const HalfSpace& h : half_spaces)
    if (place(box, h) != Place::kInside) return false;
  return !half_spaces.empty();
}

// Item 29: the case hoop_front_region, times 100.
TEST(HoopAsPrinted, hides_what_stands_between_the_cell_and_the_hoop) {
  const Loop hoop{{{-200, -200, 400}}, {{200, -200, 400}}, {{200, 200, 800}}, {{-200, 200, 800}}};
  const IntBox before{{{-10, 90, 490}}, {{10, 110, 510}}},
      behind{{{-10, 90, 900}}, {{10, 110, 910}}};
  ASSERT_TRUE(seen_convex(kCell, hoop));
  ASSERT_EQ(sight({to_polygon(hoop)}, exact({0, 0, 0}), exact({0, 100, 495})), Sight::kClear);
  const auto printed = shadow(kCell, hoop, 800, Rear::kOpen);
  const auto ours = shadow(kCell, hoop, 800, Rear::kClosed);
  EXPECT_TRUE(in_shadow(before, printed));
  EXPECT_FALSE(in_shadow(before, ours));
  EXPECT_TRUE(in_shadow(behind, ours));
}

// A flat polygon, seen convex from the cell.
Loop random_flat_hoop(const IntBox& cell, Random& random) {
  static constexpr int kX[8] = {4, 3, 0, -3, -4, -3, 0, 3}, kY[8] = {0, 3, 4, 3, 0, -3, -4, -3};
  for (;;) {
    const std::int64_t cx = 4 * pick(random, -25, 25), cy = 4 * pick(random, -25, 25);
    const std::int64_t z = pick(random, 300, 420), p = pick(random, -2, 2), q = pick(random, -2, 2);
    const std::int64_t size = pick(random, 6, 12);
    Loop loop;
    for (int k = 0; k < 8; ++k) {
      if (random.below(4) == 0) continue;
      const std::int64_t x = cx + 4 * (kX[k] * size + pick(random, -6, 6));
      const std::int64_t y = cy + 4 * (kY[k] * size + pick(random, -6, 6));
      loop.push_back({{x, y, z + (p * (x - cx) + q * (y - cy)) / 4}});
    }
    bool beyond_cell = true;
    for (const IntPoint& h : loop) beyond_cell &= h[2] > cell.hi[2];
    if (beyond_cell && seen_convex(cell, loop)) return loop;
  }
}

std::int64_t farthest(const Loop& loop) {
  std::int64_t z = loop[0][2];
  for (const IntPoint& h : loop) z = std::max(z, h[2]);
  return z;
}

// Nodes, and among them those with a corner that a corner of the cell sees past all polygons.
struct Tally {
  std::size_t black = 0, seen = 0;
};
void judge(const ShadowOctree& tree, const IntBox& cell, const std::vector<ExactPolygon>& matter,
           Tally& tally) {
  for (const IntBox& node : tree.black()) {
    ++tally.black;
    bool seen = false;
    for (int k = 0; k < 64 && !seen; ++k)
      seen = sight(matter, exact(to_vec(cell.corner(k / 8))), exact(to_vec(node.corner(k % 8)))) ==
             Sight::kClear;
    tally.seen += seen;
  }
}

// For one flat convex hoop the corners tell the whole truth: what they do not see is hidden.
TEST(HoopsInBulk, the_corrected_octree_is_never_caught_and_the_printed_tables_are) {
  const IntBox root{{{-512, -512, 0}}, {{512, 512, 1024}}};
  Tally table1, table2, open_rear, one, two;
  for (std::uint64_t seed = 1; seed <= scene_count(kPairs); ++seed) {
    Random random(seed);
    const std::int64_t a = pick(random, 13, 96);
    const IntBox cell{{{-a, -a, -pick(random, 13, 128)}}, {{a, a, 0}}};
    const Loop h1 = random_flat_hoop(cell, random), h2 = random_flat_hoop(cell, random);
    const std::vector matter1{to_polygon(h1)}, matter2{to_polygon(h1), to_polygon(h2)};
    const auto shadow1 = shadow(cell, h1, farthest(h1), Rear::kClosed);
    const auto shadow2 = shadow(cell, h2, farthest(h2), Rear::kClosed);

    ShadowOctree first(root, 4, Colour::kUndetermined);
    for (const HalfSpace& plane : shadow1) first.update_first(plane);
    judge(first, cell, matter1, table1);

    ShadowOctree ours(root, 4, Colour::kWhite);
    ours.add_shadow(shadow1);
    judge(ours, cell, matter1, one);
    ShadowOctree second = ours;
    for (const HalfSpace& plane : shadow2) second.update_second(plane);
    judge(second, cell, matter2, table2);
    ours.add_shadow(shadow2);
    judge(ours, cell, matter2, two);

    ShadowOctree no_rear(root, 4, Colour::kWhite);
    no_rear.add_shadow(shadow(cell, h1, farthest(h1), Rear::kOpen));
    judge(no_rear, cell, matter1, open_rear);
    ASSERT_EQ(one.seen + two.seen, 0u) << "pair " << seed;
  }
  std::cout << "black nodes, of these seen: table 1 " << table1.black << ", " << table1.seen
            << "; table 2 " << table2.black << ", " << table2.seen << "; open rear "
            << open_rear.black << ", " << open_rear.seen << "; ours, one hoop " << one.black << ", "
            << one.seen << ", two " << two.black << ", " << two.seen << '\n';
  EXPECT_GT(table1.seen, 0u);
  EXPECT_GT(table2.seen, 0u);
  EXPECT_GT(open_rear.seen, 0u);
  EXPECT_GT(one.black, 10 * scene_count(kPairs));
  EXPECT_GT(two.black, one.black);
}

// A loop that is not flat, and the fan of triangles from a point anywhere inside its prism.
struct CrookedHoop {
  Loop loop;
  IntPoint apex;
  bool blocks(const IntPoint& from, const IntPoint& to) const {
    for (std::size_t k = 0; k < loop.size(); ++k)
      if (stab(from, to, apex, loop[k], loop[(k + 1) % loop.size()]) != Stab::kMiss) return true;
    return false;
  }
};

TEST(HoopsInBulk, any_surface_across_a_crooked_hoop_hides_its_shadow_only_with_a_rear) {
  std::size_t hoops = 0, hidden = 0, caught_printed = 0, hidden_printed = 0;
  for (std::uint64_t seed = 1; seed <= 20 * scene_count(kPairs); ++seed) {
    Random random(seed);
    const std::int64_t a = pick(random, 5, 60);
    const IntBox cell{{{-a, -a, -100}}, {{a, a, 0}}};
    CrookedHoop hoop{random_flat_hoop(cell, random), {}};
    for (IntPoint& h : hoop.loop) h[2] += pick(random, -90, 90);
    if (!seen_convex(cell, hoop.loop)) continue;
    ++hoops;
    hoop.apex = {{pick(random, -90, 90), pick(random, -90, 90), pick(random, 150, 500)}};
    const std::int64_t rear = std::max(farthest(hoop.loop), hoop.apex[2]);
    const auto printed = shadow(cell, hoop.loop, rear, Rear::kOpen);
    const auto ours = shadow(cell, hoop.loop, rear, Rear::kClosed);
    for (int k = 0; k < 40; ++k) {
      const IntPoint p{{pick(random, -400, 400), pick(random, -400, 400), pick(random, 20, 900)}};
      const IntPoint eye{{pick(random, -a, a), pick(random, -a, a), pick(random, -100, 0)}};
      const IntBox point{p, p};
      if (!in_shadow(point, printed)) continue;
      const bool seen = !hoop.blocks(eye, p);
      ++hidden_printed, caught_printed += seen;
      if (!in_shadow(point, ours)) continue;
      ++hidden;
      ASSERT_FALSE(seen) << "hoop " << seed;
    }
  }
  std::cout << hoops << " hoops; points hidden, of these seen: as printed " << hidden_printed
            << ", " << caught_printed << "; with a rear " << hidden << ", 0\n";
  EXPECT_GT(caught_printed, 0u);
  EXPECT_GT(hidden, 1000u);
}

}  // namespace
}  // namespace pvsfarm::reference

// Erosion as printed: the supporting segment of the cell, its mirror on the object, and the erosion
// of a contour by a segment beside the origin. Each calls what is seen hidden; the gate, all of the
// object, and the moved contour do not. All decisions are in integers.
//
//   PVSFARM_SCENES=N   at least N random scenes a test
#include <gtest/gtest.h>

#include <iostream>

#include "common/base/random.hpp"
#include "tests/adversarial/reference/erosion_reference.hpp"
#include "tests/adversarial/reference/polygon_erosion.hpp"
#include "tests/adversarial/reference/scene_count.hpp"

namespace pvsfarm::reference {
namespace {

constexpr std::uint64_t kScenes = 4000;

std::int64_t pick(Random& random, std::int64_t lo, std::int64_t hi) {
  return lo + static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(hi - lo + 1)));
}
std::int64_t even(Random& random, std::int64_t lo, std::int64_t hi) {
  return 2 * pick(random, lo / 2, hi / 2);
}

// The case erosion_PQ from above, in tenths: y here is the case's z.
const ErosionScene kWideObject{{{-10, -10}, {10, 10}},
                               {{500, -1000}, {500, 1000}},
                               {{{100, -230}, {100, -200}}, {{490, -979}, {490, 1020}}}};

// Item 33.
TEST(ErosionAsPrinted, by_the_supporting_segment_hides_what_is_seen_past_its_side) {
  ASSERT_TRUE(is_clear(kWideObject, {{9, 9}, {500, -1000}}));
  EXPECT_TRUE(hides_by_erosion(kWideObject, Source::kSupportingSegment));
  EXPECT_FALSE(hides_by_erosion(kWideObject, Source::kGate));
  EXPECT_FALSE(hides_by_erosion(kWideObject, Source::kCell));
}

TEST(Erosion, by_the_gate_keeps_thin_walls_that_the_whole_cell_erodes_away) {
  const ErosionScene scene{
      {{-10, -10}, {10, 10}}, {{500, -10}, {520, 10}}, {{{100, -40}, {100, 40}}}};
  EXPECT_TRUE(hides_by_erosion(scene, Source::kGate));
  EXPECT_FALSE(hides_by_erosion(scene, Source::kCell));
}

TEST(Erosion, a_wall_behind_the_object_or_through_it_hides_nothing) {
  for (const std::int64_t x : {500, 520, 600})
    for (const Source source : {Source::kCell, Source::kSupportingSegment, Source::kGate})
      EXPECT_FALSE(hides_by_erosion(
          {{{-10, -10}, {10, 10}}, {{500, -10}, {520, 10}}, {{{x, -400}, {x + 50, 400}}}}, source));
}

TEST(Erosion, two_walls_that_only_together_hide_are_fused) {
  ErosionScene scene{{{-2, -10}, {0, 10}}, {{500, -100}, {520, 100}}, {}};
  scene.walls = {{{100, -40}, {140, 14}}, {{200, -14}, {240, 70}}};
  EXPECT_TRUE(hides_by_erosion(scene, Source::kGate));
  scene.walls.pop_back();
  EXPECT_FALSE(hides_by_erosion(scene, Source::kGate));
}

// Item 33, its mirror.
TEST(ErosionAsPrinted, of_an_object_aslant_tests_a_single_point_of_it) {
  const ErosionScene scene{
      {{0, -10}, {0, 10}}, {{400, 500}, {600, 600}}, {{{200, 206}, {200, 234}}}};
  ASSERT_TRUE(is_clear(scene, {{0, 0}, {400, 520}}));
  EXPECT_TRUE(hides_by_stencil(scene));
  EXPECT_FALSE(hides_by_erosion(scene, Source::kGate));
}

// Half of them like erosion_PQ: a wide object, a wall before it that is a little short, and a small
// wall before the rest as the supporting segment sees it.
ErosionScene random_scene(Random& random) {
  ErosionScene s;
  const std::int64_t hx = even(random, 0, 20), hy = even(random, 4, 20);
  s.cell = {{-hx, -hy}, {hx, hy}};
  const std::int64_t far = even(random, 200, 600), deep = even(random, 0, 20);
  if (random.below(2) == 0) {
    const std::int64_t half = even(random, 8 * hy, 100 * hy), at = far - even(random, 2, 20);
    s.object = {{far, -half}, {far + deep, half}};
    const std::int64_t missing = even(random, 4, 40);
    s.walls.push_back({{at, -half + missing}, {at, half + 40}});
    const std::int64_t x = even(random, hx + 20, 200);
    const std::int64_t y = -half * (x + hx) / (far + hx) + even(random, -6, 20);
    s.walls.push_back({{x, y - even(random, hy, 2 * hy)}, {x, y + even(random, hy, 2 * hy)}});
    return s;
  }
  // Straight ahead, or aside.
  const std::int64_t half = even(random, 2, 200), aside = random.below(2) == 0 ? 60 : far;
  const std::int64_t at = even(random, -aside, aside);
  s.object = {{far, at - half}, {far + deep, at + half}};
  for (std::uint64_t k = 2 + random.below(6); k > 0; --k) {
    const std::int64_t x = even(random, hx + 4, far - 60), thick = even(random, 0, 50);
    const std::int64_t y = at * x / far + even(random, -60, 60), reach = even(random, 10, 250);
    s.walls.push_back({{x, y - reach}, {x + thick, y + reach}});
  }
  return s;
}

struct Tally {
  int hidden = 0, seen = 0;
  void add(bool is_hidden, bool is_seen) {
    hidden += is_hidden;
    seen += is_hidden && is_seen;
  }
};
std::ostream& operator<<(std::ostream& out, const Tally& t) {
  return out << t.hidden << ", " << t.seen;
}

TEST(ErosionInBulk, the_gate_and_the_whole_cell_are_never_caught_and_the_segment_is) {
  Tally printed, gate, cell;
  for (std::uint64_t seed = 1; seed <= scene_count(kScenes); ++seed) {
    Random random(seed);
    const ErosionScene scene = random_scene(random);
    const bool by_segment = hides_by_erosion(scene, Source::kSupportingSegment);
    const bool by_gate = hides_by_erosion(scene, Source::kGate);
    const bool by_cell = hides_by_erosion(scene, Source::kCell);
    FlatSegment witness;
    const bool seen = (by_segment || by_gate || by_cell) && find_witness(scene, witness);
    printed.add(by_segment, seen), gate.add(by_gate, seen), cell.add(by_cell, seen);
    ASSERT_FALSE((by_gate || by_cell) && seen) << "scene " << seed;
  }
  std::cout << "hidden, of these seen: as printed " << printed << "; by the gate " << gate
            << "; by the cell " << cell << '\n';
  EXPECT_GT(printed.seen, 0);
  EXPECT_GT(gate.hidden, 100);
  EXPECT_GT(cell.hidden, 20);
}

TEST(ErosionInBulk, an_object_cut_by_its_supporting_segment_is_caught_and_all_of_it_never) {
  Tally printed, ours;
  for (std::uint64_t seed = 1; seed <= scene_count(kScenes); ++seed) {
    Random random(seed);
    ErosionScene scene = random_scene(random);
    scene.cell.lo.x = scene.cell.hi.x = 0;
    const bool by_stencil = hides_by_stencil(scene),
               by_gate = hides_by_erosion(scene, Source::kGate);
    FlatSegment witness;
    const bool seen = (by_stencil || by_gate) && find_witness(scene, witness);
    printed.add(by_stencil, seen), ours.add(by_gate, seen);
    ASSERT_FALSE(by_gate && seen) << "scene " << seed;
  }
  std::cout << "hidden, of these seen: as printed " << printed << "; all of the object " << ours
            << '\n';
  EXPECT_GT(printed.seen, 0);
  EXPECT_GT(ours.hidden, 100);
}

const Polygon kUnit{{0, 0}, {10, 0}, {10, 10}, {0, 10}};  // in tenths

// Case 43, item 34: [0, 1] eroded by [5, 5.1] is [-5, -4.1].
TEST(ContourErosion, by_a_segment_beside_the_origin_moves_the_contour) {
  const std::vector<FlatPoint> x{{50, 0}, {51, 0}};
  for (std::int64_t v = -80; v <= 80; ++v) {
    EXPECT_EQ(in_erosion(kUnit, x, {v, 5}), -50 < v && v < -41) << v;
    EXPECT_EQ(in_erosion_as_printed(kUnit, x, {v, 5}), 0 <= v && v <= 10) << v;
  }
}

// Item 34, end to end. X is the left side of the cell [-1, 1]^2 seen from its middle, as for any
// object wider than the cell (the paper's figure 5); in hundredths.
TEST(ContourErosionAsPrinted, leaves_a_thin_wall_whole_and_hides_what_is_seen_past_its_end) {
  const ErosionScene scene{
      {{-100, -100}, {100, 100}}, {{5000, -1000}, {5100, 1000}}, {{{1000, -210}, {1050, 210}}}};
  const Polygon wall{{1000, -210}, {1050, -210}, {1050, 210}, {1000, 210}};
  const std::vector<FlatPoint> x{{-100, -100}, {-100, 100}};
  ASSERT_TRUE(is_clear(scene, {{-100, 100}, {5000, 1000}}));
  // The shrunk object is [51, 52] x [-9, 9]: every ray to it from the middle of the cell crosses
  // x = 10.2 at a height that the printed erosion holds; in truth most of them miss the erosion.
  const std::int64_t reach = 900 * 1020 / 5100;
  for (std::int64_t y = -reach; y <= reach; ++y)
    ASSERT_TRUE(in_erosion_as_printed(wall, x, {1020, y})) << y;
  for (std::int64_t at = 1000; at <= 1200; ++at)
    EXPECT_FALSE(in_erosion(wall, x, {at, 900 * at / 5100})) << at;
  EXPECT_FALSE(hides_by_erosion(scene, Source::kGate));
}

Polygon random_polygon(Random& random) {
  // An L, or the hull of a triangle or quadrangle; all coordinates multiples of 16.
  const auto at = [&] { return 16 * pick(random, -20, 20); };
  if (random.below(2) == 0) {
    const std::int64_t x = at(), y = at(), w = 16 * pick(random, 4, 20),
                       h = 16 * pick(random, 4, 20);
    return {{x, y},    {x + w, y}, {x + w, y + h / 4}, {x + w / 4, y + h / 4}, {x + w / 4, y + h},
            {x, y + h}};
  }
  for (;;) {
    const Polygon p{{at(), at()}, {at(), at()}, {at(), at()}, {at(), at()}};
    bool convex = true;
    for (int k = 0; k < 4; ++k) convex &= turn(p[k], p[(k + 1) % 4], p[(k + 2) % 4]) > 0;
    if (convex) return p;
  }
}

TEST(ErosionInBulk, of_contours_holds_only_points_that_keep_all_of_x_inside) {
  Tally printed, ours;
  for (std::uint64_t seed = 1; seed <= scene_count(kScenes) / 4; ++seed) {
    Random random(seed);
    const Polygon polygon = random_polygon(random);
    const FlatPoint a{16 * pick(random, -12, 12), 16 * pick(random, -12, 12)};
    const FlatPoint b{a.x + 16 * pick(random, -6, 6), a.y + 16 * pick(random, -6, 6)};
    for (int k = 0; k < 40; ++k) {
      const FlatPoint v{16 * pick(random, -30, 30), 16 * pick(random, -30, 30)};
      bool leaves = false;  // of the 17 points of v + X, one lies outside
      for (int part = 0; part <= 16; ++part)
        leaves |= !contains(polygon, {v.x + (a.x * (16 - part) + b.x * part) / 16,
                                      v.y + (a.y * (16 - part) + b.y * part) / 16});
      const bool by_ours = in_erosion(polygon, {a, b}, v);
      printed.add(in_erosion_as_printed(polygon, {a, b}, v), leaves);
      ours.add(by_ours, leaves);
      ASSERT_FALSE(by_ours && leaves) << "polygon " << seed;
    }
  }
  std::cout << "points kept, of these wrong: as printed " << printed << "; moved " << ours << '\n';
  EXPECT_GT(printed.seen, 0);
  EXPECT_GT(ours.hidden, 500);
}

}  // namespace
}  // namespace pvsfarm::reference

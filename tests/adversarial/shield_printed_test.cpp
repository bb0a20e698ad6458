// ShieldTester as printed calls visible cells hidden, twice over; the corrected forms do not.
// Everything is decided in integers: a witness segment here is a proof.
//
//   PVSFARM_SCENES=N   at least N random scenes a test
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>

#include "tests/adversarial/reference/scene_count.hpp"
#include "tests/adversarial/reference/shield_reference.hpp"

namespace pvsfarm::reference {
namespace {

constexpr std::uint64_t kSurfaces = 1500;

// Neither meets the surface nor touches it.
bool clear(const TriangleMesh& mesh, const IntPoint& from, const IntPoint& to) {
  for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t)
    if (stab(from, to, mesh, t) != Stab::kMiss) return false;
  return true;
}

const IntBox kBelow{{{50, 50, -2000}}, {{750, 750, -1000}}};
const IntBox kAbove{{{53, 53, 1000}}, {{747, 747, 2000}}};

// A flat shield across z = 0, wider than the tube. A strip of two triangles that reach out of the
// tube at both ends parts what the curve encloses in two; the right part may have a hole.
TriangleMesh parted_shield(bool with_hole) {
  TriangleMesh mesh;
  mesh.vertices = {{{350, 400, 0}}, {{450, 400, 0}}, {{400, -100, 0}}, {{400, 900, 0}}};
  enum : int { kP, kQ, kBottom, kTop };
  mesh.triangles = {{kBottom, kQ, kP}, {kTop, kP, kQ}};
  for (const bool right : {false, true}) {
    const int first = static_cast<int>(mesh.vertices.size());
    for (const auto& [x, y] :
         {std::pair{900, -100}, {900, 900}, {550, 300}, {650, 400}, {550, 500}})
      mesh.vertices.push_back({{right ? x : 800 - x, y, 0}});
    const int low = first, high = first + 1, r1 = first + 2, r2 = first + 3, r3 = first + 4;
    const int q = right ? kQ : kP;
    const int side[9][3] = {{kBottom, r1, q}, {kBottom, low, r1}, {low, r2, r1},
                            {low, high, r2},  {high, r3, r2},     {high, kTop, r3},
                            {kTop, q, r3},    {q, r1, r3},        {r1, r2, r3}};
    for (int k = 0; k < (right && with_hole ? 8 : 9); ++k) {
      const auto& [a, b, c] = side[k];
      mesh.triangles.push_back(right ? std::array{a, b, c} : std::array{a, c, b});
    }
  }
  return mesh;
}

// Item 18, case 41.
TEST(ShieldAsPrinted, answers_after_the_first_part_without_a_hole_though_another_has_one) {
  const TriangleMesh mesh = parted_shield(true);
  ASSERT_TRUE(clear(mesh, {{583, 400, -1000}}, {{583, 400, 1000}}));
  const Corners a = kBelow.corners(), b = kAbove.corners();
  EXPECT_EQ(walk_and_invade(mesh, a, b, Invasion::kUntilFirstClosedPart), ShieldAnswer::kHidden);
}

TEST(Shield, with_two_parts_and_one_hole_does_not_know) {
  const TriangleMesh mesh = parted_shield(true);
  Random random(1);
  EXPECT_EQ(walk_and_invade(mesh, kBelow.corners(), kAbove.corners(), Invasion::kAllParts),
            ShieldAnswer::kUnknown);
  EXPECT_NE(flood(mesh, kBelow, kAbove, random), ShieldAnswer::kHidden);
}

TEST(Shield, with_two_parts_and_no_hole_hides) {
  const TriangleMesh mesh = parted_shield(false);
  Random random(1);
  EXPECT_EQ(walk_and_invade(mesh, kBelow.corners(), kAbove.corners(), Invasion::kAllParts),
            ShieldAnswer::kHidden);
  EXPECT_EQ(flood(mesh, kBelow, kAbove, random), ShieldAnswer::kHidden);
}

// A plate across z = 0 from y0 upwards, wider than the tube elsewhere.
TriangleMesh plate_from(std::int64_t y0) {
  return {{{{-511, y0, 0}}, {{1502, y0, 0}}, {{1501, 1503, 0}}, {{-503, 1504, 0}}},
          {{0, 1, 2}, {0, 2, 3}}};
}

// Every corner of a cell leaves it, but those of the face y = lo move along +y.
Corners printed_moves() {
  Corners moves;
  for (int k = 0; k < 8; ++k) moves[k] = {{(k & 1) ? 4 : -4, 4, (k & 4) ? 3 : -3}};
  return moves;
}

Corners outward_moves() {
  Corners moves;
  for (int k = 0; k < 8; ++k) moves[k] = {{(k & 1) ? 4 : -4, (k & 2) ? 4 : -4, (k & 4) ? 3 : -3}};
  return moves;
}

const IntBox kLowCell{{{0, 0, -2000}}, {{1000, 1000, -1000}}};
const IntBox kHighCell{{{-10, 0, 1000}}, {{990, 1020, 2000}}};

// Item 21.
TEST(ShieldAsPrinted, corners_moved_outside_leave_a_slit_of_the_old_cell_untested) {
  const TriangleMesh plate = plate_from(2);
  ASSERT_TRUE(clear(plate, {{500, 0, -1000}}, {{500, 0, 1000}}));
  EXPECT_EQ(walk_perturbed(plate, kLowCell, kHighCell, {printed_moves(), printed_moves()},
                           Perturbation::kAsPrinted),
            ShieldAnswer::kHidden);
}

// Case 44.
TEST(Shield, a_perturbed_hull_must_contain_the_old_one) {
  const CellMoves good{outward_moves(), outward_moves()};
  for (const CellMoves& moves :
       {CellMoves{printed_moves(), printed_moves()}, CellMoves{printed_moves(), outward_moves()},
        CellMoves{outward_moves(), printed_moves()}})
    for (const int y0 : {2, -50})
      EXPECT_EQ(walk_perturbed(plate_from(y0), kLowCell, kHighCell, moves, Perturbation::kChecked),
                ShieldAnswer::kUnknown);
  EXPECT_NE(walk_perturbed(plate_from(2), kLowCell, kHighCell, good, Perturbation::kChecked),
            ShieldAnswer::kHidden);
  EXPECT_EQ(walk_perturbed(plate_from(-50), kLowCell, kHighCell, good, Perturbation::kChecked),
            ShieldAnswer::kHidden);
}

// Every corner moved by up to 6 steps so that it is outside its cell; if `sideways`, never towards
// smaller y.
Corners random_moves(const IntBox& cell, bool sideways, Random& random) {
  Corners moves;
  for (int k = 0; k < 8; ++k)
    for (bool outside = false; !outside;) {
      for (int axis = 0; axis < 3; ++axis) {
        moves[k][axis] = static_cast<std::int64_t>(random.below(13)) - 6;
        if (sideways && axis == 1) moves[k][axis] = std::abs(moves[k][axis]);
        const std::int64_t at = cell.corner(k)[axis] + moves[k][axis];
        outside |= at < cell.lo[axis] || at > cell.hi[axis];
      }
    }
  return moves;
}

TEST(ShieldInBulk, a_checked_perturbation_is_never_caught_and_the_printed_one_is) {
  int hidden[2] = {0, 0}, caught[2] = {0, 0};
  for (std::uint64_t seed = 1; seed <= scene_count(kSurfaces); ++seed) {
    Random random(seed);
    const bool sideways = random.below(2) == 0;
    CellMoves moves{random_moves(kLowCell, sideways, random),
                    random_moves(kHighCell, sideways, random)};
    if (random.below(4) == 0) moves = {outward_moves(), outward_moves()};
    const std::int64_t y0 = static_cast<std::int64_t>(random.below(16)) - 9;
    const TriangleMesh plate = plate_from(y0);
    const bool seen = clear(plate, {{500, 0, -1000}}, {{500, 0, 1000}});
    EXPECT_EQ(seen, y0 > 0);
    for (const Perturbation form : {Perturbation::kAsPrinted, Perturbation::kChecked}) {
      const bool ours = form == Perturbation::kChecked;
      const bool says =
          walk_perturbed(plate, kLowCell, kHighCell, moves, form) == ShieldAnswer::kHidden;
      hidden[ours] += says;
      caught[ours] += says && seen;
      EXPECT_FALSE(ours && says && seen) << "scene " << seed;
    }
  }
  std::cout << "hidden, of these seen: any move outside " << hidden[0] << ", " << caught[0]
            << "; cells that hold the old ones " << hidden[1] << ", " << caught[1] << '\n';
  EXPECT_GT(caught[0], 0);
  EXPECT_GT(hidden[1], 50);
}

// Case 42.
TEST(Shield, a_segment_through_a_vertex_of_the_mesh_decides_nothing) {
  const IntPoint below{{0, 0, -10}}, above{{0, 0, 10}};
  const IntPoint v{{0, 0, 0}}, p{{10, 1, 0}}, q{{-3, 10, 0}}, r{{-10, -7, 0}};
  EXPECT_EQ(stab(below, above, v, p, q), Stab::kDegenerate);
  EXPECT_EQ(stab(below, above, p, {{-10, -1, 0}}, q), Stab::kDegenerate);  // through an edge
  EXPECT_EQ(stab(below, v, p, q, r), Stab::kDegenerate);                   // ends on it
  EXPECT_EQ(stab(below, above, p, q, r), Stab::kHit);
  EXPECT_EQ(stab(below, above, p, r, q), Stab::kHit);
  EXPECT_EQ(stab(below, {{40, 0, 10}}, p, q, r), Stab::kMiss);
}

TEST(Shield, tries_other_rays_where_one_meets_a_vertex_and_gives_up_where_all_do) {
  // Four triangles around a vertex in the middle.
  const TriangleMesh pyramid{
      {{{0, 0, 1}}, {{90, 91, 0}}, {{-90, 92, 0}}, {{-91, -90, 0}}, {{92, -91, 0}}},
      {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}}};
  const IntBox point_below{{{0, 0, -50}}, {{0, 0, -50}}}, point_above{{{0, 0, 50}}, {{0, 0, 50}}};
  const IntBox below{{{-1, -1, -50}}, {{1, 1, -50}}}, above{{{-1, -1, 50}}, {{1, 1, 50}}};
  int hidden = 0;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Random random(seed);
    EXPECT_EQ(flood(pyramid, point_below, point_above, random), ShieldAnswer::kUnknown);
    hidden += flood(pyramid, below, above, random) == ShieldAnswer::kHidden;
  }
  EXPECT_EQ(hidden, 50);
}

std::int64_t pick(Random& random, std::int64_t lo, std::int64_t hi) {
  return lo + static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(hi - lo + 1)));
}

// A wavy grid between two cells, some triangles missing. In some, one column of vertices is drawn
// apart, so that triangles between reach out of the tube at both ends and part what is enclosed.
struct RandomShield {
  TriangleMesh mesh;
  std::vector<std::array<IntPoint, 3>> holes;
  IntBox below, above;
};

RandomShield random_shield(std::uint64_t seed) {
  Random random(seed);
  RandomShield s;
  const auto cell = [&](std::int64_t z) {
    const auto low = [&] { return pick(random, -1000, -200); };
    const auto high = [&] { return pick(random, 200, 1000); };
    return IntBox{{{low(), low(), z}}, {{high(), high(), z + 600}}};
  };
  s.below = cell(-3000 + pick(random, 0, 50));
  s.above = cell(2400 + pick(random, 0, 50));
  const int n = 3 + static_cast<int>(random.below(9));
  const std::int64_t step = 2600 / n, wave = pick(random, 0, 700);
  const int apart = n / 2 + static_cast<int>(random.below(2));
  const bool parted = random.below(2) == 0;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      std::int64_t y = -1300 + j * step + pick(random, -step / 4, step / 4);
      if (parted && i == apart) y = j <= n / 2 ? -1400 + 50 * j : 1400 - 50 * (n - j);
      s.mesh.vertices.push_back(
          {{-1300 + i * step + pick(random, -step / 4, step / 4), y, pick(random, -wave, wave)}});
    }
  // One triangle in `missing`: many holes or few.
  const std::uint64_t missing = 2 + random.below(2 * n * n);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const int a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
      const bool rising = random.below(2) == 0;
      for (const auto& t : rising ? std::array{std::array{a, b, d}, std::array{a, d, c}}
                                  : std::array{std::array{a, b, c}, std::array{b, d, c}}) {
        if (random.below(missing) != 0)
          s.mesh.triangles.push_back(t);
        else
          s.holes.push_back({s.mesh.vertices[t[0]], s.mesh.vertices[t[1]], s.mesh.vertices[t[2]]});
      }
    }
  return s;
}

IntPoint point_of(const IntBox& box, Random& random) {
  IntPoint p = box.corner(static_cast<int>(random.below(8)));
  for (int k = 0; k < 3; ++k)
    if (random.below(2) == 0) p[k] = pick(random, box.lo[k], box.hi[k]);
  return p;
}

// From a point below through a point of a missing triangle, and between points anywhere.
bool sees_through(const RandomShield& s, Random& random) {
  for (int ray = 0; ray < 400; ++ray) {
    const IntPoint from = point_of(s.below, random);
    IntPoint to = point_of(s.above, random);
    if (ray % 4 != 0 && !s.holes.empty()) {
      const auto& hole = s.holes[random.below(s.holes.size())];
      const std::int64_t u = pick(random, 0, 64), v = pick(random, 0, 64 - u), w = 64 - u - v;
      IntPoint through;
      for (int k = 0; k < 3; ++k)
        through[k] = (u * hole[0][k] + v * hole[1][k] + w * hole[2][k]) / 64;
      for (int k = 0; k < 2; ++k)
        to[k] = from[k] + (through[k] - from[k]) * (to[2] - from[2]) / (through[2] - from[2]);
      if (to[0] < s.above.lo[0] || to[0] > s.above.hi[0] || to[1] < s.above.lo[1] ||
          to[1] > s.above.hi[1])
        continue;
    }
    if (clear(s.mesh, from, to)) return true;
  }
  return false;
}

TEST(ShieldInBulk, the_corrected_forms_are_never_caught_and_the_printed_one_is) {
  struct Tally {
    int hidden = 0, caught = 0;
  } printed, all_parts, flooded;
  for (std::uint64_t seed = 1; seed <= scene_count(kSurfaces); ++seed) {
    const RandomShield s = random_shield(seed);
    Random random(seed ^ 0x5eed);
    const Corners a = s.below.corners(), b = s.above.corners();
    const bool by_print =
        walk_and_invade(s.mesh, a, b, Invasion::kUntilFirstClosedPart) == ShieldAnswer::kHidden;
    const bool by_all = walk_and_invade(s.mesh, a, b, Invasion::kAllParts) == ShieldAnswer::kHidden;
    const bool by_flood = flood(s.mesh, s.below, s.above, random) == ShieldAnswer::kHidden;
    const bool seen = (by_print || by_all || by_flood) && sees_through(s, random);
    printed.hidden += by_print, printed.caught += by_print && seen;
    all_parts.hidden += by_all, all_parts.caught += by_all && seen;
    flooded.hidden += by_flood, flooded.caught += by_flood && seen;
    EXPECT_FALSE(by_all && seen) << "all parts invaded, surface " << seed;
    EXPECT_FALSE(by_flood && seen) << "flooded, surface " << seed;
  }
  std::cout << "hidden, of these seen: as printed " << printed.hidden << ", " << printed.caught
            << "; all parts " << all_parts.hidden << ", " << all_parts.caught << "; flood "
            << flooded.hidden << ", " << flooded.caught << '\n';
  EXPECT_GT(printed.caught, 0);
  EXPECT_GT(all_parts.hidden, 100);
  EXPECT_GT(flooded.hidden, 100);
}

}  // namespace
}  // namespace pvsfarm::reference

// The improved Projection as printed hides what a deep cell sees; taken from the front face of the
// cell it does not. The occluder is one convex polygon, so visibility has an exact answer: hidden
// if and only if every segment between vertices is blocked.
//
//   PVSFARM_SCENES=N   at least N random scenes
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "common/base/random.hpp"
#include "tests/adversarial/case_file.hpp"
#include "tests/adversarial/reference/improved_reference.hpp"
#include "tests/adversarial/reference/scene_count.hpp"

namespace pvsfarm::reference {
namespace {

constexpr std::uint64_t kScenes = 5000;

// The double nearest to a decimal of 6 places.
double decimal(double x) { return std::round(x * 1e6) / 1e6; }

const VisibilityCase& case_named(const std::string& id) {
  for (const VisibilityCase& c : all_cases())
    if (c.id == id) return c;
  throw std::out_of_range(id);
}

ImprovedQuery query_of(const VisibilityCase& c) { return {c.cell, c.occludee, *c.plane_z}; }

// Item 2.
TEST(ImprovedProjectionAsPrinted, of_a_deep_cell_hides_what_is_seen) {
  const VisibilityCase& c = case_named("improved_deep_cell");
  ASSERT_EQ(sight(exact_matter(c), exact(c.witness->first), exact(c.witness->second)),
            Sight::kClear);
  const auto polygons = occluder_polygons(c);
  EXPECT_TRUE(hides_improved(polygons, query_of(c), ViewedFrom::kWholeCell, Umbra::kOneOccluder));
  EXPECT_FALSE(hides_improved(polygons, query_of(c), ViewedFrom::kFrontFace, Umbra::kOneOccluder));
}

TEST(ImprovedProjection, hides_beyond_the_vanishing_point_what_the_plain_one_cannot) {
  const VisibilityCase& c = case_named("vanishing_point");
  EXPECT_TRUE(hides_improved(occluder_polygons(c), query_of(c), ViewedFrom::kFrontFace,
                             Umbra::kOneOccluder));
}

TEST(ImprovedProjection, must_not_use_a_point_that_only_two_occluders_together_cover) {
  const VisibilityCase& c = case_named("fig9");
  const auto polygons = occluder_polygons(c);
  EXPECT_TRUE(hides_improved(polygons, query_of(c), ViewedFrom::kFrontFace, Umbra::kAllOccluders));
  EXPECT_FALSE(hides_improved(polygons, query_of(c), ViewedFrom::kFrontFace, Umbra::kOneOccluder));
}

TEST(ImprovedProjection, hides_no_case_that_is_seen) {
  for (const VisibilityCase& c : cases_that(Must::kVisible)) {
    if (c.occludee.lo.z <= c.cell.hi.z) continue;
    for (const double beyond : {0.0, 0.5, 1.0, 3.0, 10.0, 40.0})
      EXPECT_FALSE(hides_improved(occluder_polygons(c),
                                  {c.cell, c.occludee, decimal(c.occludee.hi.z + beyond)},
                                  ViewedFrom::kFrontFace, Umbra::kOneOccluder))
          << c.id << ", plane " << beyond << " beyond";
  }
}

// The convex hull of points of one plane z, counter-clockwise.
std::vector<Vec3> hull_of(std::vector<Vec3> points) {
  std::sort(points.begin(), points.end(),
            [](const Vec3& a, const Vec3& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  std::vector<Vec3> hull;
  const auto add = [&](const Vec3& p, std::size_t least) {
    while (hull.size() >= least &&
           cross(hull.back() - hull[hull.size() - 2], p - hull.back()).z <= 0)
      hull.pop_back();
    hull.push_back(p);
  };
  for (const Vec3& p : points) add(p, 2);
  const std::size_t lower = hull.size();
  for (auto p = points.rbegin() + 1; p != points.rend(); ++p) add(*p, lower + 1);
  hull.pop_back();
  return hull;
}

struct ImprovedScene {
  ImprovedQuery query;
  std::vector<Vec3> occluder;
};

// An occluder that just covers one or the other improved Projection, so that it covers nothing else
// to speak of.
ImprovedScene random_scene(std::uint64_t seed) {
  Random random(seed);
  const auto between = [&](double lo, double hi) { return decimal(random.between(lo, hi)); };
  const double front = between(-10, -2), deep = random.below(4) == 0 ? 0 : between(0.1, 30);
  const double hx = between(0.1, 2), hy = between(0.1, 2);
  ImprovedScene s;
  s.query.cell = {{-hx, -hy, decimal(front - deep)}, {hx, hy, front}};
  const Vec3 lo{between(-8, 8), between(-8, 8), decimal(front * random.between(0.1, 0.6))};
  s.query.occludee = {lo,
                      {decimal(lo.x + between(0.01, 3)), decimal(lo.y + between(0.01, 3)),
                       decimal(lo.z * random.between(0.1, 1))}};
  const double z = decimal(front + (lo.z - front) * random.between(0.2, 0.95));
  const auto from = random.below(2) == 0 ? ViewedFrom::kWholeCell : ViewedFrom::kFrontFace;
  const PlaneRectangle r = improved_projection(s.query, from);
  std::vector<Vec3> points;
  for (int corner = 0; corner < 4; ++corner)
    for (int v = 0; v < 8; ++v) {
      const Vec3 eye = s.query.cell.corner(v);
      const Vec3 p{(corner & 1) ? r.hi[0] : r.lo[0], (corner & 2) ? r.hi[1] : r.lo[1], 0};
      const Vec3 at = eye + (p - eye) * ((z - eye.z) / -eye.z);
      for (int k = 0; k < 4; ++k)  // a little more, for the grid
        points.push_back({decimal(at.x + ((k & 1) ? 2e-6 : -2e-6)),
                          decimal(at.y + ((k & 2) ? 2e-6 : -2e-6)), z});
    }
  s.occluder = hull_of(points);
  return s;
}

TEST(ImprovedInBulk, the_front_face_is_never_caught_and_the_whole_cell_is) {
  int hidden[2] = {0, 0}, seen[2] = {0, 0};
  for (std::uint64_t seed = 1; seed <= scene_count(kScenes); ++seed) {
    const ImprovedScene s = random_scene(seed);
    const bool truth = hides(ExactPolygon(s.occluder), s.query.cell, s.query.occludee);
    for (const ViewedFrom from : {ViewedFrom::kWholeCell, ViewedFrom::kFrontFace}) {
      if (!hides_improved({s.occluder}, s.query, from, Umbra::kOneOccluder)) continue;
      const int ours = from == ViewedFrom::kFrontFace;
      ++hidden[ours];
      seen[ours] += !truth;
      EXPECT_TRUE(truth || !ours) << "scene " << seed;
    }
  }
  std::cout << "hidden, of these seen: as printed " << hidden[0] << ", " << seen[0]
            << "; from the front face " << hidden[1] << ", " << seen[1] << '\n';
  EXPECT_GT(seen[0], 0);
  EXPECT_GT(hidden[1] * 4, static_cast<int>(scene_count(kScenes)));
}

}  // namespace
}  // namespace pvsfarm::reference

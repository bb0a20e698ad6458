// The improved Projection as printed hides what a deep cell sees; taken from the front face of the
// cell it does not. The occluder is one convex polygon, so visibility has an exact answer: hidden
// if and only if every segment between vertices is blocked.
//
//   PVSFARM_SCENES=N   at least N random scenes
#include <gtest/gtest.h>

#include <iostream>

#include "tests/adversarial/case_file.hpp"
#include "tests/adversarial/reference/improved_scenes.hpp"
#include "tests/adversarial/reference/scene_count.hpp"

namespace pvsfarm::reference {
namespace {

constexpr std::uint64_t kScenes = 5000;

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

TEST(ImprovedInBulk, the_front_face_is_never_caught_and_the_whole_cell_is) {
  int hidden[2] = {0, 0}, seen[2] = {0, 0};
  for (std::uint64_t seed = 1; seed <= scene_count(kScenes); ++seed) {
    const ImprovedScene s = improved_scene(seed, 0);
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

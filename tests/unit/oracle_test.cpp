// The judges are judged: against each other, and on scenes whose answer is plain.
#include <gtest/gtest.h>

#include <array>

#include "common/base/random.hpp"
#include "tests/support/aimed_rays.hpp"
#include "tests/support/exact_oracle.hpp"
#include "tests/support/make_objects.hpp"
#include "tests/support/ray_oracle.hpp"

namespace pvsfarm {
namespace {

SourceObject plate(double z, double x0, double x1, double y0, double y1) {
  return polygon_object(
      "plate", std::array{Vec3{x0, y0, z}, Vec3{x1, y0, z}, Vec3{x1, y1, z}, Vec3{x0, y1, z}},
      Role::kOnlyOccludes);
}

Vec3 on_grid(Random& random, int reach) {
  const auto coordinate = [&] {
    return static_cast<double>(static_cast<int>(random.below(2 * reach + 1)) - reach) / 100;
  };
  const double x = coordinate(), y = coordinate();
  return {x, y, coordinate()};
}

TEST(RayOracle, finds_the_nearest_of_several_walls) {
  SceneSource source;
  for (double z : {7.0, 3.0, 5.0}) source.objects.push_back(plate(z, -1, 1, -1, 1));
  const RayOracle oracle(source);
  const auto hit = oracle.first_hit({{0.1, 0.2, 0}, {0.1, 0.2, 10}});
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->object, 1u);
  EXPECT_DOUBLE_EQ(hit->t, 0.3);
  EXPECT_FALSE(oracle.first_hit({{0.1, 0.2, 0}, {0.1, 0.2, 2.9}}));
}

TEST(RayOracle, sees_through_a_slit_wider_than_the_margin_only) {
  SceneSource source;
  source.objects = {plate(5, -10, -1e-6, -10, 10), plate(5, 1e-6, 10, -10, 10)};
  const RayOracle oracle(source);
  const Segment through{{0, 0, 0}, {0, 0, 9}};
  EXPECT_TRUE(oracle.clear_by(through, 0.9e-6));
  EXPECT_FALSE(oracle.clear_by(through, 1.1e-6));
}

TEST(RayOracle, touching_is_blocked) {
  SceneSource source;
  source.objects = {plate(5, 0, 10, -10, 10)};
  const RayOracle oracle(source);
  EXPECT_FALSE(oracle.clear_by({{0, 0, 0}, {0, 0, 9}}, 1e-9));  // along the border
  EXPECT_FALSE(oracle.clear_by({{1, 0, 0}, {1, 0, 5}}, 1e-9));  // ends on it
  EXPECT_TRUE(oracle.clear_by({{1, 0, 0}, {1, 0, 4.99}}, 1e-9));
}

TEST(RayOracle, one_sided_matter_blocks_its_front_only) {
  SceneSource source;
  source.objects = {plate(5, -1, 1, -1, 1)};  // front towards +z
  source.objects[0].two_sided = false;
  const RayOracle oracle(source);
  EXPECT_TRUE(oracle.clear_by({{0, 0, 0}, {0, 0, 9}}, 1e-9));
  EXPECT_FALSE(oracle.clear_by({{0, 0, 9}, {0, 0, 0}}, 1e-9));
  EXPECT_FALSE(oracle.first_hit({{0, 0, 0}, {0, 0, 9}}));
  EXPECT_TRUE(oracle.first_hit({{0, 0, 9}, {0, 0, 0}}));
}

TEST(RayOracle, what_moves_or_is_no_occluder_blocks_nothing) {
  SceneSource source;
  source.objects = {plate(5, -1, 1, -1, 1), plate(6, -1, 1, -1, 1), plate(7, -1, 1, -1, 1)};
  source.objects[0].dynamic = true;
  source.objects[1].occluder = false;
  const RayOracle oracle(source);
  EXPECT_EQ(oracle.blocker({{0, 0, 0}, {0, 0, 9}}, 1e-9)->object, 2u);
  EXPECT_TRUE(oracle.clear_by({{0, 0, 0}, {0, 0, 9}}, 1e-9, 2));
}

// Random triangles on a coarse grid, where rays meet edges and vertices all the time: what the
// double caster calls clear must be clear in integers, and nearly all that is clear it must find.
TEST(RayOracle, agrees_with_exact_arithmetic) {
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  int clear = 0, missed = 0;
  for (int scene = 0; scene < 60; ++scene) {
    SceneSource source;
    std::vector<ExactPolygon> matter;
    while (source.objects.size() < 12) {
      const std::vector<Vec3> corners{on_grid(random, 300), on_grid(random, 300),
                                      on_grid(random, 300)};
      if (length(cross(corners[1] - corners[0], corners[2] - corners[0])) < 1e-3) continue;
      source.objects.push_back(polygon_object("t", corners));
      matter.emplace_back(corners);
    }
    const RayOracle oracle(source);
    for (int ray = 0; ray < 500; ++ray) {
      const Vec3 from = on_grid(random, 400), to = on_grid(random, 400);
      const Sight truth = sight(matter, exact(from), exact(to));
      if (truth == Sight::kGrazing) continue;
      const bool judged_clear = oracle.clear_by({from, to}, 1e-8);
      EXPECT_FALSE(judged_clear && truth == Sight::kBlocked) << "seed " << kSeed;
      clear += truth == Sight::kClear;
      missed += truth == Sight::kClear && !judged_clear;
    }
  }
  EXPECT_GT(clear, 5000);
  EXPECT_LT(missed, clear / 100);  // those that end on a triangle
}

TEST(ExactOracle, closed_polygons_half_open_segments) {
  const ExactPolygon square({{0, 0, 5}, {2, 0, 5}, {2, 2, 5}, {0, 2, 5}});
  const auto look = [&](Vec3 from, Vec3 to) { return square.sight(exact(from), exact(to)); };
  EXPECT_EQ(look({1, 1, 0}, {1, 1, 9}), Sight::kBlocked);
  EXPECT_EQ(look({0, 0, 0}, {0, 0, 9}), Sight::kBlocked);  // through a corner
  EXPECT_EQ(look({-0.000001, 0, 0}, {-0.000001, 0, 9}), Sight::kClear);
  EXPECT_EQ(look({1, 1, 0}, {1, 1, 5}), Sight::kClear);    // ends on it
  EXPECT_EQ(look({1, 1, 5}, {1, 1, 9}), Sight::kBlocked);  // starts on it
  EXPECT_EQ(look({-1, 1, 5}, {3, 1, 5}), Sight::kGrazing);
}

TEST(ExactOracle, one_plate_hides_what_is_wholly_behind_it) {
  const ExactPolygon square({{-20, -20, 3}, {20, -20, 3}, {20, 20, 3}, {-20, 20, 3}});
  const Box cell{{-1, -1, -1}, {1, 1, 1}};
  EXPECT_TRUE(hides(square, cell, {{-1, -1, 6}, {1, 1, 7}}));
  EXPECT_FALSE(hides(square, cell, {{25, -1, 3.5}, {26, 1, 4}}));
}

TEST(AimedRays, find_an_object_seen_only_through_a_narrow_slit) {
  SceneSource source;
  source.objects = {plate(5, -50, -0.001, -50, 50), plate(5, 0.001, 50, -50, 50)};
  source.objects.push_back(box_object("behind", {{-9, -9, 12}, {9, 9, 13}}, Role::kOnlyOccluded));
  const RayOracle oracle(source);
  const AimedRays rays(source, oracle);
  Random random(3);
  const std::array<std::uint32_t, 1> hidden{2};
  const auto report = rays.search(Cell::aligned({{-1, -1, -1}, {1, 1, 1}}), hidden, 20000, random);
  ASSERT_EQ(report.violations.size(), 1u);
  EXPECT_EQ(report.violations[0].object, 2u);
}

TEST(AimedRays, find_nothing_behind_a_whole_wall) {
  SceneSource source;
  source.objects = {plate(5, -50, 50, -50, 50)};
  source.objects.push_back(box_object("behind", {{-9, -9, 12}, {9, 9, 13}}, Role::kOnlyOccluded));
  const RayOracle oracle(source);
  const AimedRays rays(source, oracle);
  Random random(3);
  const std::array<std::uint32_t, 1> hidden{1};
  const auto report = rays.search(Cell::aligned({{-1, -1, -1}, {1, 1, 1}}), hidden, 20000, random);
  EXPECT_GE(report.rays, 20000u);
  EXPECT_TRUE(report.violations.empty());
}

}  // namespace
}  // namespace pvsfarm

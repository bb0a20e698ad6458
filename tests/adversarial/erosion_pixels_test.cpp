// Erosion on pixels: sampling at the middles closes slits and loses small objects; covering wholly
// and touching do not.
//
//   PVSFARM_SCENES=N   at least N random scenes
#include <gtest/gtest.h>

#include <iostream>

#include "tests/adversarial/case_file.hpp"
#include "tests/adversarial/reference/erosion_raster.hpp"
#include "tests/adversarial/reference/scene_count.hpp"
#include "tests/support/aimed_rays.hpp"
#include "tests/support/make_objects.hpp"

namespace pvsfarm::reference {
namespace {

constexpr std::uint64_t kScenes = 2000;
constexpr std::uint64_t kRays = 400;

Box plate(double x0, double x1, double z) { return {{x0, -10, z}, {x1, 10, z}}; }

bool exactly_clear(const std::vector<Box>& boxes, const Vec3& from, const Vec3& to) {
  std::vector<ExactPolygon> matter;
  for (const Box& box : boxes)
    for (ExactPolygon& face : exact_faces(box)) matter.push_back(std::move(face));
  return sight(matter, exact(from), exact(to)) == Sight::kClear;
}

const Box kSmallCell{{-0.001, -0.001, -0.002}, {0.001, 0.001, 0}};

// Item 35.
TEST(ErosionSampledAtMiddles, closes_a_slit_between_two_of_them) {
  RasterQuery query{.cell = kSmallCell,
                    .occludee = {{-1, -1, 8}, {1, 1, 9}},
                    .boxes = {plate(-10, -0.002, 5), plate(0.002, 10, 5)}};
  ASSERT_TRUE(exactly_clear(query.boxes, {0, 0, 0}, {0, 0, 8}));
  EXPECT_TRUE(hides_by_raster(query, Sampling::kPixelMiddles));
  EXPECT_FALSE(hides_by_raster(query, Sampling::kConservative));
  query.boxes = {plate(-10, 10, 5)};
  EXPECT_TRUE(hides_by_raster(query, Sampling::kConservative));
}

TEST(ErosionSampledAtMiddles, loses_an_object_between_them_behind_nothing_at_all) {
  const RasterQuery query{
      .cell = kSmallCell, .occludee = {{0.01, 0.01, 5}, {0.02, 0.02, 5.1}}, .boxes = {}};
  EXPECT_TRUE(hides_by_raster(query, Sampling::kPixelMiddles));
  EXPECT_FALSE(hides_by_raster(query, Sampling::kConservative));
}

// Boxes of a case, its rectangles along the axes too.
std::vector<Box> boxes_of(const VisibilityCase& c) {
  std::vector<Box> boxes;
  for (const CaseOccluder& o : c.occluders) {
    Box box;
    for (const Vec3& p : o.polygon) box.add(p);
    const bool rectangle =
        o.polygon.size() == 4 && (box.size().x == 0 || box.size().y == 0 || box.size().z == 0);
    if (o.box) boxes.push_back(*o.box);
    if (rectangle) boxes.push_back(box);
  }
  return boxes;
}

TEST(ErosionByTheGate, hides_no_case_that_is_seen) {
  for (const VisibilityCase& c : cases_that(Must::kVisible))
    for (const int resolution_px : {8, 64, 255})
      EXPECT_FALSE(hides_by_raster({c.cell, c.occludee, boxes_of(c), resolution_px},
                                   Sampling::kConservative))
          << c.id << ", " << resolution_px << " px";
}

TEST(ErosionByTheGate, hides_the_cases_that_are_hidden) {
  for (const VisibilityCase& c : cases_that(Must::kHidden))
    EXPECT_TRUE(hides_by_raster({c.cell, c.occludee, boxes_of(c), 64}, Sampling::kConservative))
        << c.id;
}

// Plates with slits, one behind the other.
RasterQuery random_query(Random& random) {
  RasterQuery query;
  const Vec3 half{random.between(0.0005, 0.2), random.between(0.0005, 0.2), 0};
  query.cell = {{-half.x, -half.y, random.between(-0.5, 0)}, {half.x, half.y, 0}};
  for (std::uint64_t k = 1 + random.below(3); k > 0; --k) {
    const double at = random.between(-2, 2), z = random.between(2, 7);
    const double slit = random.below(2) == 0 ? random.between(0, 0.05) : random.between(0, 1);
    query.boxes.push_back(plate(-20, at - slit, z));
    query.boxes.push_back(plate(at + slit, 20, z));
  }
  const Vec3 at{random.between(-2, 2), random.between(-2, 2), random.between(7.5, 9)};
  const double size = random.below(2) == 0 ? random.between(0.001, 0.2) : random.between(0.2, 2);
  query.occludee = {at, at + Vec3(size)};
  return query;
}

bool seen(const RasterQuery& query, Random& random) {
  SceneSource source;
  for (const Box& box : query.boxes)
    source.objects.push_back(box_object("plate", box, Role::kOnlyOccludes));
  const std::uint32_t occludee[] = {static_cast<std::uint32_t>(source.objects.size())};
  source.objects.push_back(box_object("occludee", query.occludee, Role::kOnlyOccluded));
  const RayOracle oracle(source);
  return !AimedRays(source, oracle)
              .search(Cell::aligned(query.cell), occludee, kRays, random)
              .violations.empty();
}

TEST(ErosionInBulk, on_pixels_wholly_covered_is_never_caught_and_at_middles_is) {
  int hidden[2] = {0, 0}, caught[2] = {0, 0};
  for (std::uint64_t seed = 1; seed <= scene_count(kScenes); ++seed) {
    Random random(seed);
    const RasterQuery query = random_query(random);
    const bool says[2] = {hides_by_raster(query, Sampling::kPixelMiddles),
                          hides_by_raster(query, Sampling::kConservative)};
    const bool is_seen = (says[0] || says[1]) && seen(query, random);
    for (int form = 0; form < 2; ++form) {
      hidden[form] += says[form];
      caught[form] += says[form] && is_seen;
    }
    EXPECT_FALSE(says[1] && is_seen) << "scene " << seed;
  }
  std::cout << "hidden, of these seen: at middles " << hidden[0] << ", " << caught[0]
            << "; wholly covered " << hidden[1] << ", " << caught[1] << '\n';
  EXPECT_GT(caught[0], 0);
  EXPECT_GT(hidden[1], 100);
}

}  // namespace
}  // namespace pvsfarm::reference

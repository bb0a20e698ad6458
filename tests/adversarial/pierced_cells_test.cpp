// Cells that walls pass through though no coordinate seems to say so: without any depth, in the
// very plane where the rows of a wall's triangles meet; or given by axes that look the other way.
#include <gtest/gtest.h>

#include "tests/support/evaluation.hpp"
#include "tests/support/make_objects.hpp"
#include "tests/support/make_solids.hpp"

namespace pvsfarm {
namespace {

EvaluatorSettings only(Method method) {
  EvaluatorSettings settings = provers_only(RasterKind::kDirect);
  settings.methods = {method};
  return settings;
}

SourceObject ball(double x) {
  return box_object("ball", {{x - 0.2, -0.2, 0}, {x + 0.2, 0.2, 0.4}}, Role::kOnlyOccluded);
}

// With eyes on both sides of x = 1/2.
const Cell kFlat = Cell::aligned({{-1, -1, 0}, {1, 1, 0}});

// Across x, of squares with corners at z = 0.
SourceObject wall(double x) {
  SourceObject wall;
  add_sheet(wall, 12, [x](int i, int j) { return Vec3{x, 3.0 * (i - 6), 3.0 * (j - 6)}; });
  set_role(wall, Role::kOnlyOccludes);
  return wall;
}

// Whatever stands between, a ball to its left and one to its right are seen; posts before them draw
// projection planes there.
void expect_seen_on_both_sides(const SourceObject& between, const Cell& cell = kFlat) {
  SceneSource source{{between, ball(-5), ball(5)}};
  for (const double x : {-3.0, 3.0})
    source.objects.push_back(
        box_object("post", {{x - 0.2, 2, 2}, {x + 0.2, 3, 3}}, Role::kOnlyOccludes));
  for (const Method method : {Method::kProjection, Method::kFineProjection, Method::kSurfaces,
                              Method::kSlices, Method::kSweep, Method::kShafts}) {
    Evaluation evaluation(source, only(method));
    EXPECT_FALSE(evaluation.hides(1, cell)) << to_string(method);
    EXPECT_FALSE(evaluation.hides(2, cell)) << to_string(method);
  }
}

TEST(FlatCell, sees_both_sides_of_a_wall_whose_rows_meet_in_it) {
  expect_seen_on_both_sides(wall(0.5));
}

TEST(FlatCell, sees_inside_and_outside_of_a_solid_whose_rows_meet_in_it) {
  SourceObject solid = fine_box({{0.5, -18, -18}, {18, 18, 18}}, 12);
  set_role(solid, Role::kOnlyOccludes);
  expect_seen_on_both_sides(solid);
}

TEST(FlatCell, on_the_ground_sees_inside_and_outside_of_a_house_without_a_floor) {
  SourceObject house = fine_box({{0.5, -18, 0}, {18, 18, 9}}, 6, kAllSides & ~kLowZ);
  set_role(house, Role::kOnlyOccludes);
  expect_seen_on_both_sides(house);
}

// The same box of space as from 0 to 1 along x.
TEST(MirroredCell, sees_both_sides_of_a_wall_that_passes_through_it) {
  Cell cell{.lo = {-1, -1, -1}, .hi = {0, 1, 1}};
  cell.axes[0] = {-1, 0, 0};
  expect_seen_on_both_sides(wall(0.75), cell);
}

// It ends beside the cell, which reaches from 0 to 1, and not beside its mirror image.
TEST(MirroredCell, sees_past_a_wall_that_ends_beside_it) {
  SourceObject wall;
  add_sheet(wall, 12, [](int i, int j) { return Vec3{i - 0.45, 5, 3.0 * (j - 6)}; });
  set_role(wall, Role::kOnlyOccludes);
  const SourceObject beyond =
      box_object("beyond", {{-1, 10, -0.2}, {-0.5, 10.2, 0.2}}, Role::kOnlyOccluded);
  Cell cell{.lo = {-1, -1, -1}, .hi = {0, 1, 1}};
  cell.axes[0] = {-1, 0, 0};
  for (const Method method : {Method::kSurfaces, Method::kShafts})
    EXPECT_FALSE(Evaluation({{wall, beyond}}, only(method)).hides(1, cell)) << to_string(method);
}

}  // namespace
}  // namespace pvsfarm

// Cells without any depth, which lie in the very plane where the rows of a wall's triangles meet:
// no single triangle passes through such a cell, and yet the wall does.
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

SourceObject ball(double x, double z = 0) {
  return box_object("ball", {{x - 0.2, -0.2, z - 0.2}, {x + 0.2, 0.2, z + 0.2}},
                    Role::kOnlyOccluded);
}

// With eyes on both sides of x = 1/2.
const Cell kFlat = Cell::aligned({{-1, -1, 0}, {1, 1, 0}});

// In the plane x = 1/2, of squares with corners at z = 0.
SourceObject wall() {
  SourceObject wall;
  add_sheet(wall, 12, [](int i, int j) { return Vec3{0.5, 3.0 * (i - 6), 3.0 * (j - 6)}; });
  set_role(wall, Role::kOnlyOccludes);
  return wall;
}

// Objects 1 and 2, to the left and to the right of x = 1/2.
void expect_seen_on_both_sides(const SceneSource& source) {
  for (const Method method : {Method::kProjection, Method::kFineProjection, Method::kSurfaces,
                              Method::kSlices, Method::kSweep}) {
    Evaluation evaluation(source, only(method));
    EXPECT_FALSE(evaluation.hides(1, kFlat)) << to_string(method);
    EXPECT_FALSE(evaluation.hides(2, kFlat)) << to_string(method);
  }
}

TEST(FlatCell, sees_both_sides_of_a_wall_whose_rows_meet_in_it) {
  expect_seen_on_both_sides({{wall(), ball(-5), ball(5)}});
}

TEST(FlatCell, sees_inside_and_outside_of_a_solid_whose_rows_meet_in_it) {
  SourceObject solid = fine_box({{0.5, -18, -18}, {18, 18, 18}}, 12);
  set_role(solid, Role::kOnlyOccludes);
  expect_seen_on_both_sides({{solid, ball(-5), ball(5)}});
}

TEST(FlatCell, on_the_ground_sees_inside_and_outside_of_a_house_without_a_floor) {
  SourceObject house = fine_box({{0.5, -18, 0}, {18, 18, 9}}, 6, kAllSides & ~kLowZ);
  set_role(house, Role::kOnlyOccludes);
  expect_seen_on_both_sides({{house, ball(-5, 0.2), ball(5, 0.2)}});
}

}  // namespace
}  // namespace pvsfarm

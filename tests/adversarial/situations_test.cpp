// Situations beyond cases.json: one-sided matter, the viewer's near clip, a cell inside a closed
// mesh, a parent's verdict, the ground. What is claimed visible is first proved so by rays.
#include <gtest/gtest.h>

#include <array>

#include "tests/support/evaluation.hpp"
#include "tests/support/make_objects.hpp"
#include "tests/support/ray_oracle.hpp"

namespace pvsfarm {
namespace {

const Cell kCell = Cell::aligned({{-1, -1, -1}, {1, 1, 1}});

class Situation : public testing::TestWithParam<RasterKind> {
 protected:
  EvaluatorSettings defaults() const { return provers_only(GetParam()); }
  bool hides(const SceneSource& source, std::uint32_t object, const Cell& cell = kCell) const {
    return Evaluation(source, defaults()).hides(object, cell);
  }
};

std::string name_of(const testing::TestParamInfo<RasterKind>& test) {
  return to_string(test.param);
}
INSTANTIATE_TEST_SUITE_P(Both, Situation, testing::Values(RasterKind::kDirect, RasterKind::kOsmesa),
                         name_of);

bool sees(const SceneSource& source, std::uint32_t object, const Segment& segment) {
  return RayOracle(source).clear_by(segment, 1e-9, object);
}

// A square of half side 20 across the x axis, its front towards -x (where the cell is) or +x.
SourceObject wall_at(double x, bool front_to_cell) {
  std::array p{Vec3{x, -20, -20}, Vec3{x, -20, 20}, Vec3{x, 20, 20}, Vec3{x, 20, -20}};
  if (!front_to_cell) std::swap(p[1], p[3]);
  return polygon_object("wall", p, Role::kOnlyOccludes);
}

SourceObject thing(const Box& box) { return box_object("thing", box, Role::kOnlyOccluded); }

TEST_P(Situation, a_one_sided_wall_hides_only_what_its_front_faces_away_from) {
  SceneSource source;
  source.objects = {wall_at(3, true), thing({{6, -1, -1}, {7, 1, 1}})};
  source.objects[0].two_sided = false;
  EXPECT_FALSE(sees(source, 1, {{1, 0, 0}, {6, 0, 0}}));
  EXPECT_TRUE(hides(source, 1));

  source.objects[0] = wall_at(3, false);
  source.objects[0].two_sided = false;
  EXPECT_TRUE(sees(source, 1, {{1, 0, 0}, {6, 0, 0}}));
  EXPECT_FALSE(hides(source, 1));
}

// A cell may be given by three axes that are a left-handed frame: the same box.
TEST_P(Situation, a_one_sided_wall_has_the_same_front_for_a_cell_with_left_handed_axes) {
  const Cell turned{.origin = {0.1, 0, 0}, .lo = {-1, -0.9, -1}, .hi = {0.8, 0.9, 1}};
  for (int axis = 0; axis < 3; ++axis) {
    Cell cell = turned;
    cell.axes[axis] = -cell.axes[axis];
    for (const bool front : {true, false}) {
      // With a wing, so that it is a surface too.
      std::array wing{Vec3{3, 20, -20}, Vec3{3, 20, 20}, Vec3{9, 40, 20}, Vec3{9, 40, -20}};
      if (!front) std::swap(wing[1], wing[3]);
      SceneSource source;
      source.objects = {wall_at(3, front), thing({{6, -1, -1}, {7, 1, 1}})};
      append(source.objects[0], polygon_object("wing", wing));
      source.objects[0].two_sided = false;
      EXPECT_EQ(hides(source, 1, cell), front) << axis;
      EXPECT_EQ(sees(source, 1, {{0, 0, 0}, {6, 0, 0}}), !front);
    }
  }
}

TEST_P(Situation, a_one_sided_wall_whose_plane_cuts_the_cell_is_seen_through_from_behind) {
  SceneSource source;
  // The plane x = 0.5 of the wall passes through the cell; the thing stands behind its front.
  std::array p{Vec3{0.5, 2, -20}, Vec3{0.5, 40, -20}, Vec3{0.5, 40, 20}, Vec3{0.5, 2, 20}};
  source.objects = {polygon_object("wall", p, Role::kOnlyOccludes),
                    thing({{-3, 20, -1}, {-2, 21, 1}})};
  source.objects[0].two_sided = false;
  const Segment past{{0.4, 0, 0}, {-2, 20, 0}};
  EXPECT_TRUE(sees(source, 1, past));
  EXPECT_FALSE(hides(source, 1));
}

TEST_P(Situation, matter_nearer_than_the_near_clip_hides_nothing) {
  SceneSource source;
  source.objects = {wall_at(1.05, true), thing({{6, -1, -1}, {7, 1, 1}})};
  EXPECT_TRUE(hides(source, 1));
  EvaluatorSettings settings = defaults();
  settings.near_m = 0.1;
  EXPECT_FALSE(Evaluation(source, settings).hides(1, kCell));
  // The viewer's clip swallows nothing of a wall beyond it.
  source.objects[0] = wall_at(1.2, true);
  EXPECT_TRUE(Evaluation(source, settings).hides(1, kCell));
}

TEST_P(Situation, a_room_around_the_cell_does_not_hide_what_is_in_it) {
  SceneSource source;
  source.objects = {box_object("room", {{-10, -10, -3}, {10, 10, 3}}, Role::kOnlyOccludes),
                    thing({{6, -1, -1}, {7, 1, 1}})};
  EXPECT_TRUE(sees(source, 1, {{1, 0, 0}, {6, 0, 0}}));
  EXPECT_FALSE(hides(source, 1));
}

TEST_P(Situation, a_room_drawn_from_outside_only_is_seen_through_from_within) {
  SceneSource source;
  source.objects = {box_object("room", {{-10, -10, -3}, {10, 10, 3}}, Role::kOnlyOccludes),
                    thing({{16, -1, -1}, {17, 1, 1}})};
  source.objects[0].two_sided = false;
  EXPECT_TRUE(sees(source, 1, {{1, 0, 0}, {16, 0, 0}}));
  EXPECT_FALSE(hides(source, 1));
  // From outside the same room is a solid.
  const Cell outside = Cell::aligned({{-21, -1, -1}, {-20, 1, 1}});
  EXPECT_TRUE(hides(source, 1, outside));
}

TEST_P(Situation, a_cell_that_reaches_out_of_a_solid_sees_past_it) {
  SceneSource source;
  source.objects = {box_object("block", {{-0.5, -20, -20}, {3, 20, 0.5}}, Role::kOnlyOccludes),
                    thing({{6, -1, -1}, {7, 1, 1}})};
  EXPECT_TRUE(sees(source, 1, {{1, 0, 1}, {6, 0, 1}}));
  EXPECT_FALSE(hides(source, 1));
}

TEST_P(Situation, a_delta_names_only_objects_of_the_parent_and_keeps_its_verdicts) {
  SceneSource source;
  source.objects = {wall_at(3, true), thing({{6, -1, -1}, {7, 1, 1}}),
                    thing({{6, 3, -1}, {7, 4, 1}}), thing({{-7, -1, -1}, {-6, 1, 1}})};
  Evaluation evaluation(source, defaults());
  VisibleSet parent = all_occludees(evaluation.scene());
  EXPECT_FALSE(parent.contains(evaluation.id_of(0)));  // the wall is no occludee
  parent.remove(evaluation.id_of(1));                  // hidden from the parent
  parent.remove(evaluation.id_of(3));                  // so was this; the child alone would see it
  const CellDelta delta = evaluation.evaluator().evaluate(CellKey{}, kCell, parent);
  EXPECT_TRUE(delta.hidden.subset_of(parent));
  EXPECT_TRUE(delta.hidden.contains(evaluation.id_of(2)));
  parent.remove_all(delta.hidden);
  EXPECT_EQ(parent.count(), 0u);
}

TEST_P(Situation, equal_input_gives_equal_output) {
  SceneSource source;
  source.objects = {wall_at(3, true), thing({{6, -1, -1}, {7, 1, 1}}),
                    thing({{6, 23, -1}, {7, 30, 1}})};
  const std::vector<std::uint32_t> fresh = Evaluation(source, defaults()).hidden_from(kCell);
  Evaluation used(source, defaults());
  used.hidden_from(Cell::aligned({{-9, -1, -1}, {-8, 1, 1}}));  // must leave no trace
  EXPECT_EQ(used.hidden_from(kCell), fresh);
}

TEST_P(Situation, a_wall_askew_hides_what_is_behind_it_though_its_box_holds_the_cell) {
  // Along x + y = 6: once as a rectangle, once as a solid of some thickness.
  const std::array front{Vec3{36, -30, -20}, Vec3{-30, 36, -20}, Vec3{-30, 36, 20},
                         Vec3{36, -30, 20}};
  SceneSource source;
  source.objects = {polygon_object("wall", front, Role::kOnlyOccludes),
                    thing({{7, 7, -1}, {8, 8, 1}})};
  EXPECT_TRUE(box_of(source.objects[0]).contains(kCell.hi));
  EXPECT_TRUE(hides(source, 1));

  source.objects[0] = box_object("wall", {{-30, 4.5, -20}, {30, 5, 20}}, Role::kOnlyOccludes);
  for (Vec3& p : source.objects[0].vertices)
    p = Vec3{p.x * 0.8 + p.y * 0.6, p.y * 0.8 - p.x * 0.6, p.z};
  EXPECT_TRUE(box_of(source.objects[0]).contains(kCell.hi));
  source.objects[1] = thing({{4, 5, -1}, {5, 6, 1}});
  EXPECT_TRUE(hides(source, 1));
}

// A long thin wall and a thing right behind it that stands on the ground, z = 0.
SceneSource wall_on_the_ground(double base) {
  SceneSource source;
  source.objects = {box_object("wall", {{-40, 10, base}, {40, 10.01, 10}}, Role::kOnlyOccludes),
                    thing({{-1, 10.02, 0}, {1, 10.5, 1}})};
  return source;
}
const Cell kEyeHeight = Cell::aligned({{-1, -1, 0.5}, {1, 1, 1}});

TEST_P(Situation, a_wall_that_stands_on_the_ground_hides_what_stands_behind_it) {
  EXPECT_TRUE(hides(wall_on_the_ground(0), 1, kEyeHeight));
}

TEST_P(Situation, a_wall_that_hovers_a_centimetre_does_not_reach_into_the_ground) {
  const SceneSource source = wall_on_the_ground(0.01);
  EXPECT_TRUE(sees(source, 1, {{0, 1, 0.5}, {0, 10.02, 0.004}}));
  EXPECT_FALSE(hides(source, 1, kEyeHeight));
}

TEST_P(Situation, from_below_the_ground_a_wall_ends_at_its_base) {
  const SceneSource source = wall_on_the_ground(0);
  const Cell below = Cell::aligned({{-1, -1, -0.5}, {1, 1, 1}});
  EXPECT_TRUE(sees(source, 1, {{0, 1, -0.5}, {0, 10.02, 0}}));
  EXPECT_FALSE(hides(source, 1, below));
}

}  // namespace
}  // namespace pvsfarm

// How often and how large: a thing in the open, a thing behind a slit, and nothing else changed.
#include <gtest/gtest.h>

#include <array>

#include "tests/support/evaluation.hpp"
#include "tests/support/make_objects.hpp"

namespace pvsfarm {
namespace {

const Cell kCell = Cell::aligned({{-2, -2, -2}, {2, 2, 2}});

SourceObject plate(const char* name, const Vec3& lo, const Vec3& hi) {
  return box_object(name, {lo, hi});
}

// A wall at x = 10 with a slit a hand wide; behind it a thing, and one before it in the open.
SceneSource wall_with_slit() {
  SceneSource source;
  source.objects.push_back(plate("left", {10, -200, -200}, {10.1, -0.05, 200}));
  source.objects.push_back(plate("right", {10, 0.05, -200}, {10.1, 200, 200}));
  source.objects.push_back(box_object("behind", {{30, -0.5, -0.5}, {31, 0.5, 0.5}}));
  source.objects.push_back(box_object("open", {{-31, -0.5, -0.5}, {-30, 0.5, 0.5}}));
  return source;
}

EvaluatorSettings with_hints(std::uint32_t viewpoints) {
  EvaluatorSettings settings;
  settings.hint_viewpoints = viewpoints;
  return settings;
}

struct Hinted {
  CellDelta delta;
  std::vector<VisibilityHint> by_source;  // {0, 0} of what is hidden
};

Hinted look(const SceneSource& source, const EvaluatorSettings& settings,
            const CellKey& key = {0, 1}) {
  Evaluation evaluation(source, settings);
  const VisibleSet parent = all_occludees(evaluation.scene());
  Hinted out{evaluation.evaluator().evaluate(key, kCell, parent),
             std::vector<VisibilityHint>(source.objects.size())};
  VisibleSet visible = parent;
  visible.remove_all(out.delta.hidden);
  if (out.delta.hints.empty()) return out;
  EXPECT_EQ(out.delta.hints.size(), 2u * visible.count());
  std::size_t position = 0;
  visible.for_each([&](ObjectId id) {
    out.by_source[evaluation.scene().object(id).file_index] = hint_at(out.delta.hints, position++);
  });
  return out;
}

}  // namespace

TEST(HintViews, a_thing_in_the_open_always_shows_and_one_behind_a_slit_seldom) {
  const auto hints = look(wall_with_slit(), with_hints(256)).by_source;
  EXPECT_EQ(hints[0].degree, 255);
  EXPECT_EQ(hints[1].degree, 255);
  EXPECT_EQ(hints[3].degree, 255);
  // Eyes that see any of it through the slit lie within a wedge: at depth x a band around y = 0,
  // 0.1 + 2 (10 - x) / 20 * 0.5 or so wide, of the cell's 4.
  EXPECT_GT(hints[2].degree, 0);
  EXPECT_LT(hints[2].degree, 0.35 * 255);
  EXPECT_LT(hints[2].size, hints[3].size);
}

TEST(HintViews, sizes_are_those_of_boxes_at_their_nearest) {
  const auto hints = look(wall_with_slit(), with_hints(256)).by_source;
  // A square metre at 28 m, seen straight on: 1 / 28^2; four points of twelve triangles scatter.
  const double angle = steradians_of(hints[3].size);
  EXPECT_GT(angle, 0.7 / (28 * 28));
  EXPECT_LT(angle, 3.5 / (28 * 28));
  EXPECT_GT(steradians_of(hints[0].size), 1);  // nearly half of all directions
}

TEST(HintViews, the_set_is_the_same_with_hints_and_without) {
  for (const bool witnesses : {true, false}) {
    EvaluatorSettings plain = witnesses ? EvaluatorSettings{} : provers_only(RasterKind::kDirect);
    EvaluatorSettings hinted = plain;
    hinted.hint_viewpoints = 32;
    const Hinted a = look(wall_with_slit(), plain), b = look(wall_with_slit(), hinted);
    EXPECT_TRUE(a.delta.hints.empty());
    EXPECT_FALSE(b.delta.hints.empty());
    EXPECT_EQ(a.delta.hidden, b.delta.hidden);
    EXPECT_EQ(a.delta.seen, b.delta.seen);
  }
}

TEST(HintViews, they_depend_on_the_cell_and_on_nothing_that_came_before) {
  const SceneSource source = wall_with_slit();
  Evaluation evaluation(source, with_hints(64));
  const VisibleSet parent = all_occludees(evaluation.scene());
  const HintBytes first = evaluation.evaluator().evaluate({0, 1}, kCell, parent).hints;
  const HintBytes other = evaluation.evaluator().evaluate({3, 5}, kCell, parent).hints;
  EXPECT_EQ(evaluation.evaluator().evaluate({0, 1}, kCell, parent).hints, first);
  EXPECT_NE(other, first);
  EXPECT_EQ(look(source, with_hints(64)).delta.hints, first);
}

TEST(HintViews, what_a_witness_saw_has_a_degree_although_no_sample_met_it) {
  SceneSource source = wall_with_slit();
  for (SourceObject* side : {&source.objects[0], &source.objects[1]})
    *side = plate(side == source.objects.data() ? "left" : "right",
                  side == source.objects.data() ? Vec3{10, -200, -200} : Vec3{10, 0.01, -200},
                  side == source.objects.data() ? Vec3{10.1, -0.01, 200} : Vec3{10.1, 200, 200});
  EvaluatorSettings settings = with_hints(1);
  settings.gap = 0;
  const Hinted hinted = look(source, settings);
  ASSERT_EQ(hinted.delta.seen.count(), 4u);  // lines past the edges of blockers find the slit
  EXPECT_EQ(hinted.by_source[2], (VisibilityHint{1, 1}));
}

}  // namespace pvsfarm

// The hierarchy of cells: children tile their parent and start from its set; what is kept shrinks.
#include <gtest/gtest.h>

#include "coordinator/tree/tree.hpp"

namespace pvsfarm {
namespace {

TreeScene objects_of_ten_triangles(std::uint32_t count) {
  return {VisibleSet::all(count), std::vector<std::uint32_t>(count, 10)};
}

VisibleSet first_objects(std::uint32_t universe, std::uint32_t count) {
  VisibleSet set = VisibleSet::none(universe);
  VisibleSet all = VisibleSet::all(universe);
  all.remove_range(0, count);
  set = VisibleSet::all(universe);
  set.remove_all(all);
  return set;
}

// Nothing of it is seen.
CellDelta delta(const CellKey& key, VisibleSet hidden, std::uint64_t point_triangles = 0) {
  VisibleSet seen = VisibleSet::none(hidden.universe());
  return {key, std::move(hidden), std::move(seen), point_triangles, {}};
}

// A cell that could be split, seeing so much in all and from its best viewpoint.
LeafReason reason_of(std::uint64_t triangles, std::uint64_t point_triangles,
                     const SubdivisionSettings& settings) {
  return leaf_reason({Cell::aligned({{0, 0, 0}, {8, 4, 1}}), 0, triangles, point_triangles},
                     settings);
}

Tree street(const SubdivisionSettings& subdivision) {
  return Tree(objects_of_ten_triangles(100),
              {Cell::aligned({{0, 0, 0}, {8, 4, 1}}), Cell::aligned({{8, 0, 0}, {16, 4, 1}})},
              subdivision);
}

}  // namespace

TEST(Tree, without_a_budget_no_cell_is_split) {
  Tree tree = street({.budget_triangles = 0, .min_cell_m = 0.1});
  EXPECT_FALSE(tree.merge(delta({0, 1}, VisibleSet::none(100))).value().split());
  EXPECT_EQ(tree.open_count(), 1u);
}

TEST(Tree, a_cell_over_its_budget_opens_two_children_that_start_from_its_set) {
  Tree tree = street({.budget_triangles = 500, .min_cell_m = 1});
  const Tree::Merged merged = tree.merge(delta({0, 1}, first_objects(100, 40))).value();
  EXPECT_EQ(merged.triangles, 600u);
  ASSERT_TRUE(merged.split());
  EXPECT_EQ(tree.open_cells(), (std::vector<CellKey>{{0, 2}, {0, 3}, {1, 1}}));
  EXPECT_EQ(tree.decoded_parent({0, 2}), merged.visible);
  EXPECT_EQ(tree.parent_set({0, 2}), tree.parent_set({0, 3}));  // one copy for both
  EXPECT_EQ(tree.parent_set({1, 1}), nullptr);                  // a root: every occludee
}

TEST(Tree, a_cell_within_its_budget_is_a_leaf) {
  Tree tree = street({.budget_triangles = 600, .min_cell_m = 1});
  EXPECT_FALSE(tree.merge(delta({0, 1}, first_objects(100, 40))).value().split());
}

TEST(Tree, no_side_shorter_than_twice_the_smallest_cell_is_split) {
  Tree tree = street({.budget_triangles = 1, .min_cell_m = 2});
  std::vector<CellKey> leaves;
  while (tree.open_count() > 0) {
    const CellKey key = tree.open_cells().front();
    if (!tree.merge(delta(key, VisibleSet::none(100))).value().split()) leaves.push_back(key);
  }
  EXPECT_EQ(leaves.size(), 2u * 8u);  // 8 x 4 x 1 into 2 x 2 x 1: twice along x, once along y
  double volume = 0;
  for (const CellKey& key : leaves) {
    const Vec3 size = tree.cell(key)->hi - tree.cell(key)->lo;
    EXPECT_GE(size.x, 2);
    EXPECT_GE(size.y, 2);
    volume += size.x * size.y * size.z;
  }
  EXPECT_EQ(volume, 16 * 4 * 1);
}

TEST(Tree, objects_outside_the_parents_set_cannot_be_hidden_again) {
  Tree tree = street({.budget_triangles = 1, .min_cell_m = 1});
  ASSERT_TRUE(tree.merge(delta({0, 1}, first_objects(100, 40))).ok());
  const auto refused = tree.merge(delta({0, 2}, first_objects(100, 1)));
  ASSERT_FALSE(refused.ok());
  EXPECT_TRUE(tree.is_open({0, 2}));  // nothing was changed
  EXPECT_FALSE(tree.merge(delta({0, 2}, VisibleSet::none(99))).ok());
}

TEST(Tree, objects_seen_must_be_in_the_cells_own_set) {
  Tree tree = street({});
  CellDelta both = delta({0, 1}, first_objects(100, 40));
  both.seen = first_objects(100, 1);  // hidden and seen at once
  EXPECT_FALSE(tree.merge(both).ok());
  both.seen = VisibleSet::none(99);
  EXPECT_FALSE(tree.merge(both).ok());
  EXPECT_TRUE(tree.is_open({0, 1}));  // nothing was changed
  both.seen = VisibleSet::all(100);
  both.seen.remove_range(0, 40);
  EXPECT_TRUE(tree.merge(both).ok());
}

TEST(Tree, a_viewpoint_that_sees_nearly_everything_ends_the_splitting) {
  for (const std::uint64_t point : {539u, 540u}) {  // of 600, a gain of a tenth at least
    Tree tree = street({.budget_triangles = 550, .min_cell_m = 1, .split_gain = 0.1});
    const auto merged = tree.merge(delta({0, 1}, first_objects(100, 40), point)).value();
    EXPECT_EQ(merged.reason, point == 539 ? LeafReason::kNone : LeafReason::kNothingToGain);
    EXPECT_EQ(tree.is_open({0, 2}), point == 539);
  }
}

TEST(StoppingRule, names_the_first_reason_that_holds) {
  const SubdivisionSettings settings{.budget_triangles = 1000, .min_cell_m = 1, .split_gain = 0.1};
  EXPECT_EQ(reason_of(5000, 0, {}), LeafReason::kNoBudget);
  EXPECT_EQ(reason_of(5000, 4999, {}), LeafReason::kNoBudget);
  EXPECT_EQ(reason_of(1000, 1000, settings), LeafReason::kBudgetMet);
  EXPECT_EQ(reason_of(1001, 0, settings), LeafReason::kNone);  // nobody looked
  EXPECT_EQ(reason_of(5000, 1000, settings), LeafReason::kNone);
  EXPECT_EQ(reason_of(5000, 1001, settings), LeafReason::kPointOverBudget);
  EXPECT_EQ(reason_of(1100, 989, settings), LeafReason::kNone);
  EXPECT_EQ(reason_of(1100, 990, settings), LeafReason::kNothingToGain);
  EXPECT_EQ(reason_of(1001, 5000, settings), LeafReason::kPointOverBudget);
  SubdivisionSettings coarse = settings;
  coarse.min_cell_m = 4.1;
  EXPECT_EQ(reason_of(5000, 1001, coarse), LeafReason::kTooSmall);
}

TEST(StoppingRule, without_a_gain_to_ask_for_no_view_stops_and_with_all_of_it_any_does) {
  const SubdivisionSettings settings{.budget_triangles = 1000, .min_cell_m = 1, .split_gain = 0};
  EXPECT_EQ(reason_of(1001, 1000, settings), LeafReason::kNone);
  EXPECT_EQ(reason_of(1001, 1001, settings), LeafReason::kNone);
  EXPECT_EQ(reason_of(1000, 1000, settings), LeafReason::kBudgetMet);
  const SubdivisionSettings all{.budget_triangles = 1000, .min_cell_m = 1, .split_gain = 1};
  EXPECT_EQ(reason_of(5000, 0, all), LeafReason::kNone);  // not knowing is no reason
  EXPECT_EQ(reason_of(5000, 1, all), LeafReason::kNothingToGain);
}

TEST(Tree, a_cell_given_up_is_a_leaf) {
  Tree tree = street({.budget_triangles = 1, .min_cell_m = 1});
  tree.give_up({0, 1});
  EXPECT_EQ(tree.open_cells(), (std::vector<CellKey>{{1, 1}}));
}

TEST(Tree, keys_that_name_no_node_have_no_cell) {
  const Tree tree = street({});
  EXPECT_FALSE(tree.cell({2, 1}).has_value());
  EXPECT_FALSE(tree.cell({0, 0}).has_value());
  EXPECT_FALSE(tree.cell({0, std::uint64_t{1} << 63}).has_value());
  ASSERT_TRUE(tree.cell({1, 3}).has_value());
  EXPECT_EQ(tree.cell({1, 3})->lo.x, 12);
}

TEST(Tree, objects_that_are_no_occludees_are_in_no_set) {
  TreeScene scene = objects_of_ten_triangles(3);
  scene.occludees.remove(ObjectId{1});
  Tree tree(scene, {Cell::aligned({{0, 0, 0}, {1, 1, 1}})}, {});
  EXPECT_EQ(tree.merge(delta({0, 1}, VisibleSet::none(3))).value().triangles, 20u);
}

}  // namespace pvsfarm

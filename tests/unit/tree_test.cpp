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

Tree street(const SubdivisionSettings& subdivision) {
  return Tree(objects_of_ten_triangles(100),
              {Cell::aligned({{0, 0, 0}, {8, 4, 1}}), Cell::aligned({{8, 0, 0}, {16, 4, 1}})},
              subdivision);
}

}  // namespace

TEST(Tree, without_a_budget_no_cell_is_split) {
  Tree tree = street({.budget_triangles = 0, .min_cell_m = 0.1});
  EXPECT_FALSE(tree.merge({0, 1}, VisibleSet::none(100)).value().split);
  EXPECT_EQ(tree.open_count(), 1u);
}

TEST(Tree, a_cell_over_its_budget_opens_two_children_that_start_from_its_set) {
  Tree tree = street({.budget_triangles = 500, .min_cell_m = 1});
  const Tree::Merged merged = tree.merge({0, 1}, first_objects(100, 40)).value();
  EXPECT_EQ(merged.triangles, 600u);
  ASSERT_TRUE(merged.split);
  EXPECT_EQ(tree.open_cells(), (std::vector<CellKey>{{0, 2}, {0, 3}, {1, 1}}));
  EXPECT_EQ(tree.decoded_parent({0, 2}), merged.visible);
  EXPECT_EQ(tree.parent_set({0, 2}), tree.parent_set({0, 3}));  // one copy for both
  EXPECT_EQ(tree.parent_set({1, 1}), nullptr);                  // a root: every occludee
}

TEST(Tree, a_cell_within_its_budget_is_a_leaf) {
  Tree tree = street({.budget_triangles = 600, .min_cell_m = 1});
  EXPECT_FALSE(tree.merge({0, 1}, first_objects(100, 40)).value().split);
}

TEST(Tree, no_side_shorter_than_twice_the_smallest_cell_is_split) {
  Tree tree = street({.budget_triangles = 1, .min_cell_m = 2});
  std::vector<CellKey> leaves;
  while (tree.open_count() > 0) {
    const CellKey key = tree.open_cells().front();
    if (!tree.merge(key, VisibleSet::none(100)).value().split) leaves.push_back(key);
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
  ASSERT_TRUE(tree.merge({0, 1}, first_objects(100, 40)).ok());
  const auto refused = tree.merge({0, 2}, first_objects(100, 1));
  ASSERT_FALSE(refused.ok());
  EXPECT_TRUE(tree.is_open({0, 2}));  // nothing was changed
  EXPECT_FALSE(tree.merge({0, 2}, VisibleSet::none(99)).ok());
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
  EXPECT_EQ(tree.merge({0, 1}, VisibleSet::none(3)).value().triangles, 20u);
}

}  // namespace pvsfarm

#include <gtest/gtest.h>

#include <algorithm>

#include "common/scene/box_runs.hpp"
#include "tests/unit/scene_shapes.hpp"

namespace pvsfarm {
namespace {

bool has(const std::vector<BoxRun>& runs, const Box& box, std::vector<std::uint32_t> members) {
  return std::any_of(runs.begin(), runs.end(), [&](const BoxRun& run) {
    return run.box.lo == box.lo && run.box.hi == box.hi && run.members == members;
  });
}

}  // namespace

TEST(BoxRuns, row_of_houses_merges_to_the_common_cross_section) {
  const std::vector<Box> row{
      {{0, 0, 0}, {8, 12, 10}}, {{8, 0, 0}, {15, 10, 14}}, {{15, 0, 0}, {24, 11, 12}}};
  const std::vector<BoxRun> runs = find_box_runs(row);
  EXPECT_TRUE(has(runs, {{0, 0, 0}, {24, 10, 10}}, {0, 1, 2}));
  EXPECT_TRUE(has(runs, {{8, 0, 0}, {24, 10, 12}}, {1, 2})) << "the higher cut of the last two";
}

TEST(BoxRuns, a_gap_is_never_covered) {
  const double almost = std::nextafter(8.0, 9.0);
  EXPECT_TRUE(find_box_runs(std::vector<Box>{{{0, 0, 0}, {8, 9, 9}}, {{almost, 0, 0}, {16, 9, 9}}})
                  .empty());
  const std::vector<BoxRun> runs = find_box_runs(
      std::vector<Box>{{{0, 0, 0}, {8, 9, 9}}, {{8, 0, 0}, {16, 9, 9}}, {{17, 0, 0}, {20, 9, 9}}});
  ASSERT_EQ(runs.size(), 1u);
  EXPECT_EQ(runs[0].box.hi.x, 16);
}

TEST(BoxRuns, boxes_that_touch_in_an_edge_only_do_not_merge) {
  EXPECT_TRUE(
      find_box_runs(std::vector<Box>{{{0, 0, 0}, {5, 5, 5}}, {{5, 5, 0}, {9, 9, 5}}}).empty());
}

TEST(BoxRuns, storeys_merge_upwards) {
  const std::vector<BoxRun> runs =
      find_box_runs(std::vector<Box>{{{0, 0, 0}, {5, 5, 3}}, {{0, 0, 3}, {5, 5, 6}}});
  ASSERT_EQ(runs.size(), 1u);
  EXPECT_EQ(runs[0].box.hi.z, 6);
}

// Every point of every run is inside one of its members, whatever the boxes.
TEST(BoxRuns, runs_of_random_boxes_lie_inside_their_members) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    std::vector<Box> boxes;
    for (int i = 0; i < 60; ++i) {  // small integers, so that many touch
      const Vec3 lo(static_cast<double>(random.below(8)), static_cast<double>(random.below(8)),
                    static_cast<double>(random.below(3)));
      boxes.push_back({lo, lo + Vec3(1 + static_cast<double>(random.below(4)),
                                     1 + static_cast<double>(random.below(4)),
                                     1 + static_cast<double>(random.below(3)))});
    }
    const std::vector<BoxRun> runs = find_box_runs(boxes);
    EXPECT_FALSE(runs.empty());
    for (const BoxRun& run : runs)
      for (int k = 0; k < 200; ++k) {
        Vec3 p;
        for (int a = 0; a < 3; ++a) p[a] = random.between(run.box.lo[a], run.box.hi[a]);
        EXPECT_TRUE(std::any_of(run.members.begin(), run.members.end(),
                                [&](std::uint32_t m) { return boxes[m].contains(p); }));
      }
  }
}

TEST(BoxRuns, a_merged_solid_is_owned_by_all_its_objects) {
  const auto scene =
      scene_of({box_object("a", {{0, 0, 0}, {8, 9, 9}}), box_object("b", {{8, 0, 0}, {16, 9, 12}}),
                box_object("c", {{40, 0, 0}, {46, 9, 12}})});
  const std::vector<Occluder> solids = solids_of(*scene);
  ASSERT_EQ(solids.size(), 4u);
  const Occluder& merged = solids.back();
  EXPECT_EQ(merged.owner_count, 2u);
  EXPECT_EQ(merged.base_points, 4u);
  EXPECT_FALSE(merged.closed) << "b is higher";
  EXPECT_TRUE(solids.front().closed);
  EXPECT_EQ(merged.box.hi, Vec3(16, 9, 9));
  for (const ObjectId owner : scene->owners(merged)) EXPECT_NE(scene->name(owner), "c");
}

}  // namespace pvsfarm

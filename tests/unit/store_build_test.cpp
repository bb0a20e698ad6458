// From rows to the nodes of a store: what is merged, what is not, and what the figures say.
#include <gtest/gtest.h>

#include <map>

#include "common/base/random.hpp"
#include "coordinator/merger/store_build.hpp"

namespace pvsfarm {
namespace {

// Objects 0 to 3 have 100 triangles, object 4 + i has i.
const std::vector<std::uint32_t> kTriangles{100, 100, 100, 100, 0, 1, 2, 3, 4, 5, 6};
const auto kObjects = static_cast<std::uint32_t>(kTriangles.size());

VisibleSet objects(std::initializer_list<std::uint32_t> ids) {
  VisibleSet set = VisibleSet::all(kObjects);
  for (std::uint32_t id = 0; id < kObjects; ++id)
    if (std::find(ids.begin(), ids.end(), id) == ids.end()) set.remove(ObjectId{id});
  return set;
}

struct KeptNodes : StoreWriter {
  std::vector<StoreNode> nodes;
  Status add(const StoreNode& node) override {
    nodes.push_back(node);
    return {};
  }
  Status finish() override { return {}; }
};

// What each cell sees and what witnesses say; an absent cell was given up.
struct CellAnswer {
  VisibleSet visible;
  VisibleSet seen = VisibleSet::none(kObjects);
  CellStatistics statistics{.cpu_ms = 1};
  std::vector<VisibilityHint> hints = {};
};
using Answers = std::map<CellKey, CellAnswer>;

struct Built {
  std::map<CellKey, StoreNode> nodes;
  StoreFigures figures;
  std::string lines;
};

Built build(const Answers& answers, const SubdivisionSettings& settings, std::uint32_t roots = 1,
            HintsWriter* hints = nullptr) {
  std::vector<Cell> cells;
  for (std::uint32_t i = 0; i < roots; ++i)
    cells.push_back(Cell::aligned({{8. * i, 0, 0}, {8. * i + 8, 1, 1}}));
  const Tree tree({VisibleSet::all(kObjects), kTriangles}, cells, settings);
  KeptNodes kept;
  StoreBuild build(tree, std::vector<std::int64_t>(roots, 7), kept, hints);
  for (const auto& [key, answer] : answers) {
    VisibleSet hidden = VisibleSet::all(kObjects);
    if (!key.is_root()) hidden = answers.at(key.parent()).visible;
    hidden.remove_all(answer.visible);
    EXPECT_TRUE(build
                    .add({key, encode(hidden), encode(answer.seen), 0, answer.statistics,
                          pack_hints(answer.hints)})
                    .ok());
  }
  EXPECT_TRUE(build.finish().ok());
  Built out{{}, build.figures(), build.statistics_lines()};
  for (std::size_t i = 1; i < kept.nodes.size(); ++i)
    EXPECT_TRUE(kept.nodes[i - 1].key < kept.nodes[i].key);
  for (StoreNode& node : kept.nodes) out.nodes[node.key] = node;
  return out;
}

SubdivisionSettings settings(double tolerance, std::uint64_t budget = 50) {
  return {.budget_triangles = budget, .min_cell_m = 2, .merge_tolerance = tolerance};
}

// A root of two leaves of so many objects.
Answers two_leaves(const VisibleSet& low, const VisibleSet& high) {
  return {{{0, 1}, {VisibleSet::all(kObjects)}}, {{0, 2}, {low}}, {{0, 3}, {high}}};
}

SubdivisionSettings one_split(double tolerance, std::uint64_t budget = 50) {
  SubdivisionSettings out = settings(tolerance, budget);
  out.min_cell_m = 4;
  return out;
}

TEST(StoreBuild, siblings_at_the_tolerance_merge_and_beyond_it_do_not) {
  // 200 triangles each; the union has 204, then 205.
  const Answers at = two_leaves(objects({0, 1}), objects({0, 1, 8}));
  const Built merged = build(at, one_split(0.02));
  ASSERT_EQ(merged.nodes.size(), 1u);
  const StoreNode& root = merged.nodes.at({0, 1});
  EXPECT_TRUE(root.leaf);
  EXPECT_EQ(root.reason, LeafReason::kMerged);
  EXPECT_EQ(root.visible, objects({0, 1, 8}));
  EXPECT_EQ(merged.figures.merged_parts, 2u);
  EXPECT_EQ(merged.figures.leaves, 1u);
  EXPECT_EQ(merged.figures.leaf_triangles, 204u);

  const Built kept = build(two_leaves(objects({0, 1}), objects({0, 1, 9})), one_split(0.02));
  ASSERT_EQ(kept.nodes.size(), 3u);
  EXPECT_FALSE(kept.nodes.at({0, 1}).leaf);
  EXPECT_EQ(kept.nodes.at({0, 2}).reason, LeafReason::kTooSmall);
  EXPECT_EQ(kept.figures.merged_parts, 0u);
}

TEST(StoreBuild, without_tolerance_only_equals_merge_and_below_zero_nothing_does) {
  const Answers equal = two_leaves(objects({0, 1}), objects({0, 1}));
  EXPECT_EQ(build(equal, one_split(0)).nodes.size(), 1u);
  EXPECT_EQ(build(equal, one_split(-1)).nodes.size(), 3u);
  EXPECT_EQ(build(two_leaves(objects({0, 1}), objects({0, 1, 5})), one_split(0)).nodes.size(), 3u);
}

TEST(StoreBuild, both_differences_count_against_the_smaller_set) {
  // 202 and 203 triangles, 205 together: within 2 % of 203, but not of 200.
  const VisibleSet a = objects({0, 1, 6}), b = objects({0, 1, 7});
  EXPECT_EQ(build(two_leaves(a, b), one_split(0.02)).nodes.size(), 1u);
  EXPECT_EQ(build(two_leaves(a, b), one_split(0.01)).nodes.size(), 3u);
}

TEST(StoreBuild, leaves_within_the_budget_are_not_merged_out_of_it) {
  const Answers answers = two_leaves(objects({0, 1, 6}), objects({0, 1, 7}));
  EXPECT_EQ(build(answers, one_split(0.02, 204)).nodes.size(), 3u);
  EXPECT_EQ(build(answers, one_split(0.02, 205)).nodes.size(), 1u);
  EXPECT_EQ(build(answers, one_split(0.02, 202)).nodes.size(), 1u);  // one is over it anyway
}

TEST(StoreBuild, tolerances_do_not_add_up_over_the_levels) {
  // 200, 203 and 203 triangles: the first two merge to 203. With the third it would be 206, within
  // 2 % of 203, but not of the 200 of the first leaf.
  Answers answers{{{0, 1}, {VisibleSet::all(kObjects)}}, {{0, 2}, {objects({0, 1, 5, 7, 8})}},
                  {{0, 3}, {objects({0, 1, 5, 6})}},     {{0, 4}, {objects({0, 1})}},
                  {{0, 5}, {objects({0, 1, 7})}},        {{0, 6}, {objects({0, 1, 5, 6})}},
                  {{0, 7}, {objects({0, 1, 5, 6})}}};
  const Built built = build(answers, settings(0.02));
  ASSERT_EQ(built.nodes.size(), 3u);
  EXPECT_FALSE(built.nodes.at({0, 1}).leaf);
  EXPECT_EQ(built.nodes.at({0, 2}).visible, objects({0, 1, 7}));  // what its parts see, not itself
  EXPECT_EQ(built.nodes.at({0, 3}).visible, objects({0, 1, 5, 6}));
  EXPECT_EQ(built.figures.leaves_by_reason[static_cast<int>(LeafReason::kMerged)], 2u);
  EXPECT_EQ(built.figures.evaluated, 7u);
  // Wider, the whole of it does, over two levels.
  const Built wide = build(answers, settings(0.03));
  ASSERT_EQ(wide.nodes.size(), 1u);
  EXPECT_EQ(wide.nodes.at({0, 1}).visible, objects({0, 1, 5, 6, 7}));
  EXPECT_EQ(wide.figures.merged_parts, 6u);
}

TEST(StoreBuild, what_the_parent_or_a_part_saw_is_seen_after_the_merge) {
  Answers answers = two_leaves(objects({0, 1, 5}), objects({0, 1, 6}));
  answers.at({0, 1}).seen = objects({1});
  answers.at({0, 2}).seen = objects({0});
  answers.at({0, 3}).seen = objects({6});
  const Built built = build(answers, one_split(0.02));
  ASSERT_EQ(built.nodes.size(), 1u);
  EXPECT_EQ(built.nodes.at({0, 1}).seen, objects({0, 1, 6}));
  EXPECT_EQ(built.figures.refuted, 0u);
  EXPECT_EQ(built.figures.seen_triangles, 202u);
  EXPECT_DOUBLE_EQ(built.figures.gap_of_triangles, 1.0 / 203);
  EXPECT_DOUBLE_EQ(built.figures.gap_of_objects, 1.0 / 4);
}

TEST(StoreBuild, an_object_seen_from_a_cell_and_hidden_from_both_halves_is_reported) {
  for (const double tolerance : {0.02, -1.0}) {
    Answers answers = two_leaves(objects({0, 1}), objects({0, 1}));
    answers.at({0, 1}).seen = objects({1, 2});
    const Built built = build(answers, one_split(tolerance));
    EXPECT_EQ(built.figures.refuted, 1u);
    const VisibleSet& seen = built.nodes.at({0, 1}).seen;
    EXPECT_EQ(seen, tolerance < 0 ? objects({1, 2}) : objects({1}));  // seen is within visible
  }
}

TEST(StoreBuild, a_cell_given_up_merges_with_nothing) {
  Answers answers = two_leaves(objects({0, 1}), VisibleSet::all(kObjects));
  answers.erase({0, 3});
  answers.at({0, 2}).visible = VisibleSet::all(kObjects);  // as the parent's, which 0/3 keeps
  const Built built = build(answers, one_split(1000));
  ASSERT_EQ(built.nodes.size(), 3u);
  EXPECT_TRUE(built.nodes.at({0, 3}).quarantined);
  EXPECT_EQ(built.nodes.at({0, 3}).reason, LeafReason::kGivenUp);
  EXPECT_EQ(built.figures.quarantined, 1u);
  EXPECT_EQ(built.figures.evaluated, 2u);
}

// The rows of hints as they are read back, by node.
std::vector<std::vector<VisibilityHint>> hints_of(const Answers& answers, double tolerance) {
  const std::string path = testing::TempDir() + "store_build.hints";
  auto writer = HintsWriter::create(path, 4).value();
  build(answers, one_split(tolerance), 1, writer.get());
  EXPECT_TRUE(writer->finish(Digest{}).ok());
  const HintsReader reader = HintsReader::open(path).value();
  std::vector<std::vector<VisibilityHint>> rows(reader.node_count());
  for (std::uint32_t node = 0; node < reader.node_count(); ++node)
    for (std::size_t i = 0; i < reader.row(node).size() / 2; ++i)
      rows[node].push_back(hint_at(reader.row(node), i));
  return rows;
}

TEST(StoreBuild, halves_that_merge_share_their_hints) {
  using Rows = std::vector<std::vector<VisibilityHint>>;
  Answers answers = two_leaves(objects({0, 1}), objects({1, 2}));
  answers.at({0, 2}).hints = {{255, 10}, {100, 20}};
  answers.at({0, 3}).hints = {{50, 90}, {7, 3}};
  // Object 1 is in both; the others do not show from the other half.
  EXPECT_EQ(hints_of(answers, 1000), (Rows{{{128, 10}, {75, 90}, {4, 3}}}));
  EXPECT_EQ(hints_of(answers, -1), (Rows{{}, {{255, 10}, {100, 20}}, {{50, 90}, {7, 3}}}));
  answers.erase({0, 3});  // given up: all of what it keeps may be in full view
  EXPECT_EQ(hints_of(answers, -1).at(2), std::vector(kObjects, kUnknownHint));
}

TEST(StoreBuild, statistics_of_merged_cells_are_in_the_line_of_what_they_became) {
  Answers answers = two_leaves(objects({0, 1}), objects({0, 1}));
  answers.at({0, 2}).statistics.methods[1] = {.seen_objects = 2, .seen_triangles = 200, .work = 30};
  answers.at({0, 3}).statistics.methods[1] = {.seen_objects = 1, .work = 3, .cpu_ms = 0.5};
  EXPECT_EQ(build(answers, one_split(0)).lines,
            "{\"cell\":0,\"ms\":3.000,\"parts\":2,\"methods\":{\"aimed-rays\":{\"hidden\":[0,0],"
            "\"seen\":[3,200],\"work\":33,\"ms\":0.500}}}\n");
  EXPECT_EQ(build(answers, one_split(-1)).lines,
            "{\"cell\":0,\"ms\":1.000}\n"
            "{\"cell\":1,\"ms\":1.000,\"methods\":{\"aimed-rays\":{\"hidden\":[0,0],"
            "\"seen\":[2,200],\"work\":30,\"ms\":0.000}}}\n"
            "{\"cell\":2,\"ms\":1.000,\"methods\":{\"aimed-rays\":{\"hidden\":[0,0],"
            "\"seen\":[1,0],\"work\":3,\"ms\":0.500}}}\n");
}

TEST(StoreBuild, the_turns_of_merged_cells_add_up_turn_by_turn) {
  Answers answers = two_leaves(objects({0, 1}), objects({0, 1}));
  const CascadeRound rays{.method = Method::kAimedRays, .open_objects = 9, .seen_objects = 2};
  const CascadeRound planes{.method = Method::kFineProjection,
                            .maps = {6, 256, 40, 5, 80, 1.25f},
                            .open_objects = 7,
                            .hidden_objects = 3,
                            .hidden_triangles = 36,
                            .work = 50,
                            .cpu_ms = 0.5f};
  CascadeRound nearer = planes;
  nearer.maps.nearest_m = 2;
  answers.at({0, 2}).statistics.rounds = {rays, planes};
  answers.at({0, 3}).statistics.rounds = {planes, rays, nearer};
  const std::string first =
      "{\"method\":\"aimed-rays\",\"cells\":2,\"open\":[18,0],\"seen\":[4,0],"
      "\"work\":0}";
  const std::string second =
      "{\"method\":\"fine-projection\",\"cells\":2,\"open\":[14,0],\"hidden\":[6,72],\"work\":100,"
      "\"ms\":1.000,\"planes\":12,\"px\":256,\"occluders\":80,\"from_m\":5.00,\"to_m\":80.00,"
      "\"extent\":1.25}";
  const std::string third =
      "{\"method\":\"fine-projection\",\"open\":[7,0],\"hidden\":[3,36],\"work\":50,\"ms\":0.500,"
      "\"planes\":6,\"px\":256,\"occluders\":40,\"from_m\":2.00,\"to_m\":80.00,\"extent\":1.25}";
  EXPECT_EQ(build(answers, one_split(0)).lines,
            "{\"cell\":0,\"ms\":3.000,\"parts\":2,\"rounds\":[" + first + ',' + second + ',' +
                third + "]}\n");
}

std::uint64_t triangles_of(const VisibleSet& set) {
  std::uint64_t sum = 0;
  set.for_each([&](ObjectId id) { sum += kTriangles[index_of(id)]; });
  return sum;
}

// Every cell of a random hierarchy, with what it sees.
void answer_subtree(Answers& answers, const CellKey& key, const VisibleSet& parent, Random& random,
                    std::uint64_t budget) {
  VisibleSet visible = parent;
  parent.for_each([&](ObjectId id) {
    if (random.below(12) == 0) visible.remove(id);
  });
  answers[key] = {visible};
  if (triangles_of(visible) <= budget || key.depth() == 3) return;
  for (const int half : {0, 1}) answer_subtree(answers, key.child(half), visible, random, budget);
}

TEST(StoreBuild, merging_loses_no_object_and_gains_no_more_than_its_tolerance) {
  std::uint64_t merged_cells = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    Answers answers;
    SubdivisionSettings split = settings(-1, 150);
    split.min_cell_m = 1;
    for (std::uint32_t root = 0; root < 3; ++root)
      answer_subtree(answers, {root, 1}, VisibleSet::all(kObjects), random, 150);
    const Built all = build(answers, split, 3);
    split.merge_tolerance = 0.02;
    const Built merged = build(answers, split, 3);
    merged_cells += all.nodes.size() - merged.nodes.size();
    EXPECT_EQ(merged.figures.merged_parts, all.nodes.size() - merged.nodes.size());
    for (const auto& [key, leaf] : all.nodes) {
      if (!leaf.leaf) continue;
      CellKey at = key;
      while (merged.nodes.count(at) == 0) at = at.parent();
      const StoreNode& now = merged.nodes.at(at);
      ASSERT_TRUE(now.leaf);
      EXPECT_TRUE(leaf.visible.subset_of(now.visible));
      EXPECT_LE(static_cast<double>(triangles_of(now.visible)),
                1.02 * static_cast<double>(triangles_of(leaf.visible)));
    }
  }
  EXPECT_GT(merged_cells, 200u);
}

}  // namespace
}  // namespace pvsfarm

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <bit>

#include "common/base/file.hpp"
#include "common/pvs/store_reader.hpp"
#include "common/pvs/store_validate.hpp"
#include "tests/unit/store_samples.hpp"

namespace pvsfarm {
namespace {

bool same_bits(const Vec3& a, const Vec3& b) {
  for (int i = 0; i < 3; ++i)
    if (std::bit_cast<std::uint64_t>(a[i]) != std::bit_cast<std::uint64_t>(b[i])) return false;
  return true;
}

bool same_bits(const Cell& a, const Cell& b) {
  return same_bits(a.origin, b.origin) && same_bits(a.axes[0], b.axes[0]) &&
         same_bits(a.axes[1], b.axes[1]) && same_bits(a.axes[2], b.axes[2]) &&
         same_bits(a.lo, b.lo) && same_bits(a.hi, b.hi);
}

void expect_same_header(StoreReader& reader, const SampleStore& written) {
  RC_ASSERT(reader.header().up == written.header.up);
  RC_ASSERT(reader.header().scene_digest == written.header.scene_digest);
  RC_ASSERT(reader.header().bake_digest == written.header.bake_digest);
  RC_ASSERT(reader.header().settings_json == written.header.settings_json);
}

void expect_same_objects(StoreReader& reader, const SampleStore& written) {
  const auto objects = reader.objects();
  RC_ASSERT(objects.ok());
  RC_ASSERT(objects->size() == written.objects.size());
  for (std::size_t i = 0; i < objects->size(); ++i) {
    const StoreObject &a = objects->at(i), &b = written.objects[i];
    RC_ASSERT(a.name == b.name);
    RC_ASSERT(same_bits(a.box.lo, b.box.lo) && same_bits(a.box.hi, b.box.hi));
    RC_ASSERT(a.triangle_count == b.triangle_count && a.file_index == b.file_index);
    RC_ASSERT(a.occluder == b.occluder && a.occludee == b.occludee && a.dynamic == b.dynamic);
  }
}

SetSize size_in(const SampleStore& store, const VisibleSet& set) {
  SetSize size{.objects = set.count()};
  set.for_each([&](ObjectId id) { size.triangles += store.objects[index_of(id)].triangle_count; });
  return size;
}

void expect_same_nodes(StoreReader& reader, const SampleStore& written) {
  RC_ASSERT(reader.node_count() == written.nodes.size());
  for (std::uint32_t i = 0; i < reader.node_count(); ++i) {
    const StoreNode& b = written.nodes[i];
    const auto a = reader.node(i);
    RC_ASSERT(a.ok());
    RC_ASSERT(a->key == b.key && a->root_id == b.root_id);
    RC_ASSERT(a->leaf == b.leaf && a->quarantined == b.quarantined);
    RC_ASSERT(a->reason == (!b.leaf         ? LeafReason::kNone
                            : b.quarantined ? LeafReason::kGivenUp
                                            : b.reason));
    RC_ASSERT(same_bits(a->cell, b.cell));
    RC_ASSERT((a->parent == -1) == b.key.is_root());
    if (a->parent >= 0)
      RC_ASSERT(written.nodes[static_cast<std::size_t>(a->parent)].key == b.key.parent());
    const auto sets = reader.sets(i);
    RC_ASSERT(sets.ok());
    RC_ASSERT(sets->visible == b.visible);
    RC_ASSERT(sets->seen == b.seen);
    RC_ASSERT(a->visible == (b.leaf ? size_in(written, b.visible) : SetSize{}));
    RC_ASSERT(a->seen == (b.leaf ? size_in(written, b.seen) : SetSize{}));
  }
}

SampleShape any_shape() {
  return {.objects = *rc::gen::inRange<std::uint32_t>(1, 400),
          .roots = *rc::gen::inRange<std::uint32_t>(0, 40),
          .max_depth = *rc::gen::inRange(0, 5),
          .kept = *rc::gen::element(0.0, 0.02, 0.5, 1.0),
          .with_seen = *rc::gen::arbitrary<bool>()};
}

TEST(Store, gives_back_all_that_was_written) {
  const TempFolder folder;
  EXPECT_TRUE(rc::check("read(write(store)) == store", [&](std::uint64_t seed) {
    const SampleStore written = random_store(seed, any_shape());
    const std::string path = folder.file("a.pvs");
    RC_ASSERT(written.write(path).ok());
    auto reader = StoreReader::open(path);
    RC_ASSERT(reader.ok());
    expect_same_header(**reader, written);
    expect_same_objects(**reader, written);
    expect_same_nodes(**reader, written);
    const Status valid = validate_store(path);
    RC_ASSERT(valid.ok());
  }));
}

TEST(Store, equal_input_gives_equal_bytes) {
  const TempFolder folder;
  const SampleStore store = random_store(7, {.roots = 900});
  ASSERT_TRUE(store.write(folder.file("a.pvs")).ok());
  ASSERT_TRUE(store.write(folder.file("b.pvs")).ok());
  EXPECT_EQ(*read_file(folder.file("a.pvs")), *read_file(folder.file("b.pvs")));
}

TEST(Store, sets_in_many_chunks_are_found) {
  const TempFolder folder;
  const SampleStore store = random_store(3, {.objects = 70, .roots = 3000, .max_depth = 1});
  ASSERT_GT(store.nodes.size(), 4096u);
  ASSERT_TRUE(store.write(folder.file("a.pvs")).ok());
  auto reader = StoreReader::open(folder.file("a.pvs"));
  ASSERT_TRUE(reader.ok());
  for (std::uint32_t i = 0; i < (*reader)->node_count(); i += 97)
    EXPECT_EQ((*reader)->sets(i)->visible, store.nodes[i].visible);
  EXPECT_TRUE(validate_store(folder.file("a.pvs")).ok());
}

// A cell split `levels` times over; leaf k sees what stands on a stretch from k on.
void add_street(SampleStore& store, const CellKey& key, const Cell& cell, int levels,
                std::uint32_t& leaf) {
  constexpr std::uint32_t kSight = 90;
  const auto objects = static_cast<std::uint32_t>(store.objects.size());
  StoreNode node{.key = key,
                 .root_id = 3,
                 .leaf = levels == 0,
                 .cell = cell,
                 .visible = VisibleSet::none(objects),
                 .seen = VisibleSet::none(objects)};
  if (node.leaf) {
    node.visible = node.seen = VisibleSet::all(objects);
    node.visible.remove_range(0, leaf);
    node.visible.remove_range(leaf + kSight, objects - leaf - kSight);
    node.seen = node.visible;
    node.seen.remove_range(leaf, 1 + leaf % 7);
    ++leaf;
  }
  store.nodes.push_back(node);
  if (node.leaf) return;
  const auto [low, high] = split(cell, 0);
  add_street(store, key.child(0), low, levels - 1, leaf);
  add_street(store, key.child(1), high, levels - 1, leaf);
}

TEST(Store, an_inner_node_sees_what_its_leaves_see_though_they_stand_in_several_chunks) {
  constexpr int kLevels = 11;
  constexpr std::uint32_t kLeaves = 1u << kLevels, kObjects = kLeaves + 100;
  const TempFolder folder;
  SampleStore store;
  store.objects.resize(kObjects, {.name = "o", .box = {{0, 0, 0}, {1, 1, 1}}, .triangle_count = 1});
  std::uint32_t leaves = 0;
  add_street(store, {0, 1}, Cell::aligned({{0, 0, 0}, {4096, 1, 1}}), kLevels, leaves);
  ASSERT_EQ(leaves, kLeaves);
  ASSERT_TRUE(store.write(folder.file("a.pvs")).ok());
  auto reader = StoreReader::open(folder.file("a.pvs"));
  ASSERT_TRUE(reader.ok());
  std::uint32_t leaf = 0;
  for (std::uint32_t i = 0; i < (*reader)->node_count(); ++i) {
    const auto node = (*reader)->node(i);
    ASSERT_TRUE(node.ok());
    const std::uint32_t below = node->leaf ? 1 : (node->end - i + 1) / 2;
    if (node->leaf || below > 300) {
      const auto sets = (*reader)->sets(i);
      ASSERT_TRUE(sets.ok());
      EXPECT_EQ(sets->visible.count(), below + 89) << i;
      EXPECT_TRUE(sets->visible.any_in(leaf, 1) && sets->visible.any_in(leaf + below + 88, 1)) << i;
      EXPECT_FALSE(sets->seen.any_in(leaf, 1)) << i;
      if (node->leaf) {
        EXPECT_EQ(sets->seen, store.nodes[i].seen) << i;
        EXPECT_EQ(node->seen.objects, 89 - leaf % 7) << i;
      } else {
        EXPECT_EQ(node->visible, SetSize{}) << i;
      }
    }
    leaf += node->leaf ? 1 : 0;
  }
  EXPECT_TRUE(validate_store(folder.file("a.pvs")).ok());
}

// What makes stores of cities small: a cell's set is told by where it turns against its
// neighbour's.
TEST(Store, a_cell_that_sees_a_little_further_than_the_last_takes_a_few_bytes) {
  constexpr std::uint32_t kLeaves = 1024, kObjects = 20'000;
  const TempFolder folder;
  SampleStore store;
  store.objects.resize(kObjects, {.name = "o", .box = {{0, 0, 0}, {1, 1, 1}}});
  std::uint32_t leaves = 0;
  add_street(store, {0, 1}, Cell::aligned({{0, 0, 0}, {4096, 1, 1}}), 10, leaves);
  ASSERT_EQ(leaves, kLeaves);
  ASSERT_TRUE(store.write(folder.file("a.pvs")).ok());
  auto reader = StoreReader::open(folder.file("a.pvs"));
  ASSERT_TRUE(reader.ok());
  EXPECT_LT((*reader)->sizes().set_bytes, 10u * kLeaves);
}

}  // namespace
}  // namespace pvsfarm

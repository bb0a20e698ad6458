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
    RC_ASSERT(a->visible == size_in(written, b.visible));
    RC_ASSERT(a->seen == size_in(written, b.seen));
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

}  // namespace
}  // namespace pvsfarm

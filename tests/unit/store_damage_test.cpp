// However a store is damaged, the run-time reader stays inside its bytes and comes to an end, and
// no wrong answer passes for a right one. Worth running under the asan preset.
#include <gtest/gtest.h>

#include <cstring>

#include "common/base/file.hpp"
#include "common/pvs/pvs_load.h"
#include "common/pvs/pvs_reader.h"
#include "common/pvs/store_validate.hpp"
#include "tests/unit/store_samples.hpp"

namespace pvsfarm {
namespace {

using Bytes = std::vector<unsigned char>;

Bytes sample_bytes(const SampleShape& shape) {
  const TempFolder folder;
  PVS_CHECK(random_store(5, shape).write(folder.file("a.pvs")).ok());
  const std::string text = *read_file(folder.file("a.pvs"));
  return {text.begin(), text.end()};
}

// Opens a copy that is exactly as long as the bytes, so that a sanitizer sees one byte too far.
pvs_status open_copy(const Bytes& bytes, std::unique_ptr<unsigned char[]>& copy, pvs_store& store) {
  copy = std::make_unique<unsigned char[]>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), copy.get());
  pvs_damage damage{};
  return pvs_open_memory(&store, copy.get(), bytes.size(), &damage);
}

// Every call of the reader. Answers do not matter, only that each comes and is in range.
void use_all_of(const pvs_store& store) {
  std::vector<std::uint64_t> visible(store.word_count), seen(store.word_count);
  // Allocated to the word, so that a sanitizer sees one too far.
  std::vector<std::uint64_t> scratch(pvs_scratch_words(&store));
  for (std::uint32_t i = 0; i < store.node_count + 1; ++i) {
    pvs_node_info info;
    pvs_node(&store, i, &info);
    pvs_read_sets(&store, i, visible.data(), seen.data(), scratch.data());
    if (store.object_count % 64 == 0) continue;
    ASSERT_EQ((visible.back() | seen.back()) >> (store.object_count % 64), 0u);
  }
  std::uint64_t sum = 0;
  for (std::uint32_t i = 0; i < store.object_count + 1; ++i) {
    pvs_object_info info;
    if (pvs_object(&store, i, &info) == PVS_OK)
      for (std::uint64_t k = 0; k < info.name_bytes; ++k)
        sum += static_cast<unsigned char>(info.name[k]);
  }
  std::uint32_t cells[4], count = 0;
  for (int i = 0; i < 20; ++i) {
    const double p[3] = {i * 9.0 - 90, 3.0 * i - 30, 10.0 - i};
    pvs_find(&store, p, cells, 4, &count);
  }
  ASSERT_GE(sum + store.settings_bytes, 0u);
}

TEST(StoreDamage, every_truncation_is_refused) {
  const Bytes whole = sample_bytes({.objects = 70, .roots = 3, .max_depth = 2});
  for (std::size_t n = 0; n < whole.size(); ++n) {
    std::unique_ptr<unsigned char[]> copy;
    pvs_store store;
    EXPECT_NE(open_copy(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n)), copy,
                        store),
              PVS_OK)
        << n;
  }
}

TEST(StoreDamage, bytes_after_the_end_are_refused) {
  Bytes bytes = sample_bytes({.roots = 1});
  bytes.resize(bytes.size() + 8);
  std::unique_ptr<unsigned char[]> copy;
  pvs_store store;
  EXPECT_NE(open_copy(bytes, copy, store), PVS_OK);
}

TEST(StoreDamage, every_single_bit_is_covered_by_a_checksum) {
  Bytes bytes = sample_bytes({.objects = 70, .roots = 3, .max_depth = 2});
  for (std::size_t bit = 0; bit < bytes.size() * 8; ++bit) {
    bytes[bit / 8] ^= static_cast<unsigned char>(1 << bit % 8);
    pvs_store store;
    pvs_damage damage{};
    const bool opened = pvs_open_memory(&store, bytes.data(), bytes.size(), &damage) == PVS_OK;
    ASSERT_FALSE(opened && pvs_verify(&store, &damage) == PVS_OK) << "bit " << bit;
    bytes[bit / 8] ^= static_cast<unsigned char>(1 << bit % 8);
  }
}

TEST(StoreDamage, a_flipped_bit_makes_no_call_leave_the_file) {
  const Bytes whole = sample_bytes({.objects = 130, .roots = 6});
  Random random(1);
  for (int trial = 0; trial < 4000; ++trial) {
    Bytes bytes = whole;
    bytes[random.below(bytes.size())] ^= static_cast<unsigned char>(1 << random.below(8));
    std::unique_ptr<unsigned char[]> copy;
    pvs_store store;
    if (open_copy(bytes, copy, store) == PVS_OK) use_all_of(store);
  }
}

void store_u64(unsigned char* at, std::uint64_t value) {
  for (int i = 0; i < 8; ++i) at[i] = static_cast<unsigned char>(value >> (8 * i));
}

// Makes all checksums right again, so that only the checks of structure stand in the way.
void reseal(Bytes& bytes) {
  unsigned char* tail = bytes.data() + bytes.size() - PVS_TAIL_BYTES;
  const std::uint64_t directory = load_u64(tail + PVS_TAIL_DIRECTORY_OFFSET);
  const std::uint64_t blocks = load_u32(tail + PVS_TAIL_BLOCKS);
  const std::uint64_t tail_offset = bytes.size() - PVS_TAIL_BYTES;
  if (directory <= tail_offset && blocks * PVS_ENTRY_BYTES <= tail_offset - directory) {
    for (std::uint64_t block = 0; block < blocks; ++block) {
      unsigned char* entry = bytes.data() + directory + block * PVS_ENTRY_BYTES;
      const std::uint64_t offset = load_u64(entry + PVS_ENTRY_OFFSET);
      const std::uint64_t length = load_u64(entry + PVS_ENTRY_LENGTH);
      if (offset <= directory && length <= directory - offset)
        store_u64(entry + PVS_ENTRY_CHECKSUM, pvs_checksum(bytes.data() + offset, length));
    }
    store_u64(tail + PVS_TAIL_DIRECTORY_CHECKSUM,
              pvs_checksum(bytes.data() + directory, tail_offset - directory));
  }
  store_u64(tail + PVS_TAIL_CHECKSUM, pvs_checksum(tail, PVS_TAIL_CHECKSUM));
}

TEST(StoreDamage, damage_with_right_checksums_makes_no_call_leave_the_file) {
  const Bytes whole = sample_bytes({.objects = 130, .roots = 6});
  Random random(2);
  int opened = 0;
  for (int trial = 0; trial < 6000; ++trial) {
    Bytes bytes = whole;
    for (std::uint64_t n = 1 + random.below(3); n > 0; --n) {
      // Counts and offsets are where it hurts: often all ones, zero, or one off.
      const std::size_t at = random.below(bytes.size() / 4) * 4;
      const std::uint64_t kind = random.below(5);
      if (kind == 0) std::memset(&bytes[at], 0xff, 4);
      if (kind == 1) std::memset(&bytes[at], 0, 4);
      if (kind == 2) ++bytes[at];
      if (kind == 3) --bytes[at];
      if (kind == 4) bytes[at + random.below(4)] = static_cast<unsigned char>(random.below(256));
    }
    reseal(bytes);
    std::unique_ptr<unsigned char[]> copy;
    pvs_store store;
    if (open_copy(bytes, copy, store) != PVS_OK) continue;
    ++opened;
    use_all_of(store);
  }
  EXPECT_GT(opened, 1000);  // else this tested the opening alone
}

TEST(StoreDamage, counts_that_overflow_when_multiplied_are_refused) {
  const Bytes whole = sample_bytes({.objects = 130, .roots = 6});
  const std::size_t tail = whole.size() - PVS_TAIL_BYTES;
  const std::size_t fields[] = {
      PVS_HEADER_OBJECT_COUNT,          PVS_HEADER_SETTINGS_BYTES,
      tail + PVS_TAIL_BLOCKS,           tail + PVS_TAIL_NODES,
      tail + PVS_TAIL_DIRECTORY_OFFSET, tail + PVS_TAIL_DIRECTORY_OFFSET + 4};
  for (const std::size_t field : fields)
    for (const unsigned value : {0xffffffffu, 0x80000000u, 0x7fffffffu, 0x20000000u, 0u}) {
      Bytes bytes = whole;
      for (int i = 0; i < 4; ++i) bytes[field + i] = static_cast<unsigned char>(value >> (8 * i));
      if (bytes == whole) continue;
      reseal(bytes);
      std::unique_ptr<unsigned char[]> copy;
      pvs_store store;
      EXPECT_NE(open_copy(bytes, copy, store), PVS_OK) << field << " = " << value;
    }
}

std::string why_invalid(const SampleStore& store) {
  const TempFolder folder;
  PVS_CHECK(store.write(folder.file("a.pvs")).ok());
  const Status status = validate_store(folder.file("a.pvs"));
  return status ? "valid" : status.error().text;
}

TEST(StoreDamage, validate_finds_what_checksums_cannot) {
  const SampleStore good = random_store(5, {.roots = 6, .kept = 0.5});
  ASSERT_EQ(why_invalid(good), "valid");
  const auto child = static_cast<std::size_t>(
      std::find_if(good.nodes.begin(), good.nodes.end(),
                   [](const StoreNode& node) { return node.leaf && !node.key.is_root(); }) -
      good.nodes.begin());
  ASSERT_LT(child, good.nodes.size());
  SampleStore bad = good;
  bad.nodes[child].seen = VisibleSet::all(150);
  EXPECT_NE(why_invalid(bad).find("counts other objects or triangles"), std::string::npos);
  bad = good;
  bad.nodes[child].root_id += 1;
  EXPECT_NE(why_invalid(bad).find("does not fit its parent"), std::string::npos);
}

// A store whose nodes' field is greater by `change`; its checksums are right, its digest is too.
std::string why_invalid_with(int field, std::uint32_t change) {
  const TempFolder folder;
  const SampleStore store = random_store(5, {.roots = 6, .kept = 0.5});
  PVS_CHECK(store.write(folder.file("a.pvs")).ok());
  const std::string text = *read_file(folder.file("a.pvs"));
  Bytes bytes(text.begin(), text.end());
  const unsigned char* tail = bytes.data() + bytes.size() - PVS_TAIL_BYTES;
  const std::uint64_t directory = load_u64(tail + PVS_TAIL_DIRECTORY_OFFSET);
  const std::uint64_t chunk =
      load_u64(bytes.data() + directory + 3 * PVS_ENTRY_BYTES + PVS_ENTRY_OFFSET);
  // In the base of the field's column, which is every node's.
  unsigned char* at = bytes.data() + chunk + PVS_CHUNK_COLUMNS +
                      static_cast<std::size_t>(field) * PVS_COLUMN_HEAD_BYTES + PVS_COLUMN_BASE;
  store_u64(at, load_u64(at) + change);
  reseal(bytes);
  const std::size_t covered = bytes.size() - PVS_TAIL_BYTES + PVS_TAIL_DIGEST;
  const Digest digest = digest_of(std::as_bytes(std::span(bytes).first(covered)));
  std::copy(digest.bytes.begin(), digest.bytes.end(), bytes.data() + covered);
  reseal(bytes);
  const std::string_view view(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  PVS_CHECK(write_file(folder.file("a.pvs"), view).ok());
  const Status status = validate_store(folder.file("a.pvs"));
  return status ? "valid" : status.error().text;
}

TEST(StoreDamage, validate_holds_the_counts_against_the_sets) {
  EXPECT_EQ(why_invalid_with(PVS_NODE_VISIBLE_OBJECTS, 0), "valid");
  for (const int field : {PVS_NODE_VISIBLE_OBJECTS, PVS_NODE_VISIBLE_TRIANGLES,
                          PVS_NODE_SEEN_OBJECTS, PVS_NODE_SEEN_TRIANGLES})
    EXPECT_NE(why_invalid_with(field, 1).find("counts other objects or triangles"),
              std::string::npos);
  // A leaf that is quarantined and yet was evaluated, and a reason that no version gives.
  EXPECT_NE(why_invalid_with(PVS_NODE_FLAGS, PVS_FLAG_QUARANTINED).find("gives a reason"),
            std::string::npos);
  EXPECT_NE(why_invalid_with(PVS_NODE_FLAGS, 9u * PVS_FIELD_REASON).find("damaged: cell 0"),
            std::string::npos);
}

TEST(StoreDamage, validate_checks_the_digest) {
  const TempFolder folder;
  Bytes bytes = sample_bytes({});
  bytes[bytes.size() - PVS_TAIL_BYTES + PVS_TAIL_DIGEST] ^= 1;
  reseal(bytes);
  ASSERT_TRUE(
      write_file(folder.file("a.pvs"), {reinterpret_cast<const char*>(bytes.data()), bytes.size()})
          .ok());
  const Status status = validate_store(folder.file("a.pvs"));
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().text.find("the digest"), std::string::npos) << status.error().text;
}

}  // namespace
}  // namespace pvsfarm

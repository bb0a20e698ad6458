#include "common/pvs/store_writer.hpp"

#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <csignal>

#include "common/base/file.hpp"
#include "common/pvs/store_validate.hpp"
#include "tests/unit/store_samples.hpp"

namespace pvsfarm {
namespace {

TEST(StoreWriter, without_finish_leaves_no_file_and_spares_the_old_one) {
  const TempFolder folder;
  ASSERT_TRUE(write_file(folder.file("old.pvs"), "old").ok());
  const SampleStore store = random_store(1);
  for (const std::string name : {"new.pvs", "old.pvs"}) {
    auto writer = StoreWriter::create(folder.file(name), store.header, store.objects);
    ASSERT_TRUE(writer.ok());
    for (const StoreNode& node : store.nodes) ASSERT_TRUE((*writer)->add(node).ok());
  }
  EXPECT_EQ(folder.file_count(), 1u);
  EXPECT_EQ(*read_file(folder.file("old.pvs")), "old");
}

TEST(StoreWriter, a_full_disk_is_an_io_error_and_leaves_no_file) {
  const TempFolder folder;
  const SampleStore store = random_store(1, {.objects = 3000, .roots = 2000});
  ::rlimit limit{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &limit), 0);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  for (const rlim_t most : {rlim_t{100}, rlim_t{2'000'000}}) {
    const ::rlimit small{most, limit.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
    const Status status = store.write(folder.file("a.pvs"));
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().kind, ErrorKind::kIo);
    EXPECT_EQ(status.error().text.rfind(folder.file("a.pvs") + ": cannot write", 0), 0u)
        << status.error().text;
    EXPECT_EQ(folder.file_count(), 0u);
  }
  std::signal(SIGXFSZ, old_handler);
}

TEST(StoreWriter, a_killed_writer_leaves_a_partial_file_that_the_next_one_takes_over) {
  const TempFolder folder;
  const SampleStore store = random_store(1, {.roots = 2000});
  const pid_t child = ::fork();
  if (child == 0) {
    auto writer = StoreWriter::create(folder.file("a.pvs"), store.header, store.objects);
    for (const StoreNode& node : store.nodes) (void)(*writer)->add(node);
    ::raise(SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_FALSE(std::filesystem::exists(folder.file("a.pvs")));
  EXPECT_TRUE(std::filesystem::exists(folder.file("a.pvs.partial")));
  ASSERT_TRUE(store.write(folder.file("a.pvs")).ok());
  EXPECT_TRUE(validate_store(folder.file("a.pvs")).ok());
  EXPECT_EQ(folder.file_count(), 1u);
}

TEST(StoreWriter, two_at_once_on_one_path_are_kept_apart) {
  const TempFolder folder;
  const SampleStore store = random_store(1);
  const auto first = StoreWriter::create(folder.file("a.pvs"), store.header, store.objects);
  ASSERT_TRUE(first.ok());
  const auto second = StoreWriter::create(folder.file("a.pvs"), store.header, store.objects);
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().kind, ErrorKind::kIo);
  EXPECT_NE(second.error().text.find("another process"), std::string::npos);
}

TEST(StoreWriter, a_missing_folder_is_an_io_error) {
  const TempFolder folder;
  const Status status = random_store(1).write(folder.file("no/a.pvs"));
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::kIo);
}

TEST(StoreWriterDeathTest, nodes_out_of_order_are_a_bug) {
  const TempFolder folder;
  SampleStore store = random_store(1, {.roots = 2, .max_depth = 0});
  std::swap(store.nodes[0], store.nodes[1]);
  EXPECT_DEATH((void)store.write(folder.file("a.pvs")), "check failed");
  store = random_store(1, {.roots = 1, .max_depth = 0});
  store.nodes[0].leaf = false;
  EXPECT_DEATH((void)store.write(folder.file("a.pvs")), "check failed");
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // they bring their own malloc
// The store of a city of 1,000,000 cells must not need the memory of its sets: measured on 60,000.
TEST(StoreWriter, memory_does_not_grow_with_the_sets) {
  constexpr std::uint32_t kObjects = 22'000, kCells = 60'000;
  const TempFolder folder;
  std::vector<StoreObject> objects(kObjects);
  Random random(3);
  std::vector<VisibleSet> sets;
  for (int i = 0; i < 500; ++i) {  // what neighbours see: runs of ids
    VisibleSet set = VisibleSet::all(kObjects);
    for (std::uint32_t at = 0; at < kObjects;) {
      const auto gap = static_cast<std::uint32_t>(random.below(1500));
      set.remove_range(at, std::min(gap, kObjects - at));
      at += gap + static_cast<std::uint32_t>(random.below(30));
    }
    sets.push_back(std::move(set));
  }
  auto writer = StoreWriter::create(folder.file("a.pvs"), {}, objects);
  ASSERT_TRUE(writer.ok());
  const auto in_use = [] { return ::mallinfo2().uordblks + ::mallinfo2().hblkhd; };
  const std::size_t before = in_use();
  std::size_t most = 0;
  StoreNode node{.seen = VisibleSet::none(kObjects)};
  for (std::uint32_t i = 0; i < kCells; ++i) {
    node.key = {i, 1};
    node.visible = sets[random.below(sets.size())];
    node.visible.remove(ObjectId{static_cast<std::uint32_t>(random.below(kObjects))});
    ASSERT_TRUE((*writer)->add(node).ok());
    if (i % 100 == 0) most = std::max(most, in_use() - before);
  }
  ASSERT_TRUE((*writer)->finish().ok());
  RecordProperty("bytes", static_cast<int>(most));
  // A chunk, and 4 + 28 bytes a cell in vectors that double.
  EXPECT_LT(most, 8'000'000u + std::size_t{kCells} * 64);
}
#endif

}  // namespace
}  // namespace pvsfarm

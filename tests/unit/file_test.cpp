#include "common/base/file.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <array>
#include <csignal>

#include "tests/unit/store_samples.hpp"

namespace pvsfarm {
namespace {

// Writes `files` while no file may grow beyond `most_bytes`: a disk that is full.
Status write_files_to_full_disk(std::span<const FileToWrite> files, rlim_t most_bytes) {
  ::rlimit limit{};
  PVS_CHECK(::getrlimit(RLIMIT_FSIZE, &limit) == 0);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  const ::rlimit small{most_bytes, limit.rlim_max};
  PVS_CHECK(::setrlimit(RLIMIT_FSIZE, &small) == 0);
  const Status status = write_files(files);
  PVS_CHECK(::setrlimit(RLIMIT_FSIZE, &limit) == 0);
  std::signal(SIGXFSZ, old_handler);
  return status;
}

TEST(WriteFiles, puts_all_in_place_and_replaces_what_was_there) {
  const TempFolder folder;
  ASSERT_TRUE(write_file(folder.file("a"), "old").ok());
  const std::string large(3'000'000, 'x');  // larger than a buffer
  const std::array files{FileToWrite{folder.file("a"), large}, FileToWrite{folder.file("b"), ""}};
  ASSERT_TRUE(write_files(files).ok());
  EXPECT_EQ(*read_file(folder.file("a")), large);
  EXPECT_EQ(*read_file(folder.file("b")), "");
  EXPECT_EQ(folder.file_count(), 2u);
}

TEST(WriteFiles, changes_none_when_the_last_does_not_fit) {
  const TempFolder folder;
  ASSERT_TRUE(write_file(folder.file("a"), "old").ok());
  const std::string large(5000, 'x');
  const std::array files{FileToWrite{folder.file("a"), "new"},
                         FileToWrite{folder.file("b"), large}};
  const Status status = write_files_to_full_disk(files, 1000);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::kIo);
  EXPECT_EQ(status.error().text.rfind(folder.file("b") + ": cannot write", 0), 0u)
      << status.error().text;
  EXPECT_EQ(*read_file(folder.file("a")), "old");
  EXPECT_EQ(folder.file_count(), 1u);
}

TEST(WriteFiles, changes_none_when_a_place_is_a_folder) {
  const TempFolder folder;
  std::filesystem::create_directory(folder.file("b"));
  const std::array files{FileToWrite{folder.file("a"), "new"},
                         FileToWrite{folder.file("b"), "new"}};
  const Status status = write_files(files);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::kIo);
  EXPECT_EQ(folder.file_count(), 1u);
}

TEST(ReadFile, says_what_it_cannot_read) {
  const TempFolder folder;
  for (const std::string& path : {folder.file(""), folder.file("none")}) {
    const auto bytes = read_file(path);
    ASSERT_FALSE(bytes.ok());
    EXPECT_EQ(bytes.error().kind, ErrorKind::kIo);
    EXPECT_EQ(bytes.error().text.rfind(path + ": cannot be read: ", 0), 0u) << bytes.error().text;
  }
}

}  // namespace
}  // namespace pvsfarm

#include "coordinator/journal/journal_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "common/base/atomic_file.hpp"
#include "common/base/check.hpp"

namespace pvsfarm {
namespace {

// The database header of SQLite's file format.
constexpr std::size_t kHeaderBytes = 100;
constexpr std::string_view kMagic{"SQLite format 3\0", 16};
constexpr std::size_t kPageSizeAt = 16, kReadVersionAt = 18, kWriteVersionAt = 19,
                      kPageCountAt = 28, kUserVersionAt = 60, kApplicationIdAt = 68;
constexpr std::byte kVersionWithWal{2};

std::uint32_t big_endian(std::span<const std::byte> bytes) {
  std::uint32_t value = 0;
  for (const std::byte b : bytes) value = value << 8 | std::to_integer<std::uint32_t>(b);
  return value;
}

Error failure(const std::string& path, const char* what) {
  return io_error(path + ": cannot " + what + ": " + std::strerror(errno));
}

Error refusal(const std::string& path, const std::string& what) {
  return invalid_input(path + ": " + what + "; move it away, or give --fresh to discard it");
}

std::uint64_t size_of(const std::string& path) {
  struct stat info {};
  return ::stat(path.c_str(), &info) == 0 ? static_cast<std::uint64_t>(info.st_size) : 0;
}

}  // namespace

bool file_exists(const std::string& path) {
  struct stat info {};
  return ::lstat(path.c_str(), &info) == 0;
}

Status check_journal_file(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return failure(path, "be read");
  std::array<std::byte, kHeaderBytes> header{};
  const ::ssize_t got = ::pread(file, header.data(), header.size(), 0);
  const Error unreadable = failure(path, "be read");
  ::close(file);
  if (got < 0) return unreadable;
  const std::span<const std::byte> bytes(header);
  if (static_cast<std::size_t>(got) < kHeaderBytes ||
      std::memcmp(header.data(), kMagic.data(), kMagic.size()) != 0)
    return refusal(path, "damaged, or not a journal of pvsfarm");
  if (big_endian(bytes.subspan(kApplicationIdAt, 4)) != kJournalId)
    return refusal(path, "a database of another program");
  const std::uint32_t format = big_endian(bytes.subspan(kUserVersionAt, 4));
  if (format != kJournalFormat)
    return invalid_input(path + ": a journal of format " + std::to_string(format) +
                         ", this program writes " + std::to_string(kJournalFormat) +
                         "; finish the bake with the program that began it, or give --fresh");
  // With a -wal file, pages may be there that are not yet here.
  const std::uint32_t page_size = big_endian(bytes.subspan(kPageSizeAt, 2));
  const std::uint64_t pages = big_endian(bytes.subspan(kPageCountAt, 4));
  if (!has_wal(path) && size_of(path) < pages * (page_size == 1 ? 65536 : page_size))
    return refusal(path, "damaged: it was cut short");
  return {};
}

Status make_journal_file(const std::string& path, std::span<std::byte> image) {
  PVS_CHECK_LE(kHeaderBytes, image.size());
  image[kReadVersionAt] = image[kWriteVersionAt] = kVersionWithWal;
  auto file = AtomicFile::create(path);
  if (!file) return file.error();
  if (Status s = (*file)->write(image); !s) return s;
  if (Status s = (*file)->complete(); !s) return s;
  // Whoever makes this file holds the lock of the AtomicFile.
  if (file_exists(path)) return {};
  bool removed = false;
  for (const char* suffix : {"-wal", "-shm", "-journal"})
    removed = ::unlink((path + suffix).c_str()) == 0 || removed;
  if (removed)
    if (Status s = sync_folder_of(path); !s) return s;
  return (*file)->commit();
}

Status remove_journal_files(const std::string& path) {
  for (const char* suffix : {"", "-wal", "-shm", "-journal"}) {
    if (::unlink((path + suffix).c_str()) != 0) {
      if (errno == ENOENT) continue;
      return failure(path + suffix, "remove");
    }
    // A crash must not bring the main file back without what belongs to it.
    if (*suffix == '\0')
      if (Status s = sync_folder_of(path); !s) return s;
  }
  return {};
}

Status sync_folder_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  const int handle = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (handle < 0) return failure(folder, "make durable");
  // EINVAL: a file system that has no such notion.
  const bool durable = ::fsync(handle) == 0 || errno == EINVAL;
  const Error error = failure(folder, "make durable");
  ::close(handle);
  return durable ? Status() : Status(error);
}

bool has_wal(const std::string& path) { return size_of(path + "-wal") > 0; }

void remove_empty_wal(const std::string& path) {
  if (!has_wal(path)) ::unlink((path + "-wal").c_str());
}

}  // namespace pvsfarm

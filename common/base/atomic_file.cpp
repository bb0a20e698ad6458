#include "common/base/atomic_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

namespace pvsfarm {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;
constexpr const char* kWantsSpace = "free space or write elsewhere";

Error failure_of(const std::string& path, const char* what, const char* mend) {
  std::string text = path + ": cannot " + what + ": " + std::strerror(errno);
  if (errno == ENOSPC || errno == EDQUOT || errno == EFBIG) mend = kWantsSpace;
  if (*mend != '\0') text += std::string("; ") + mend;
  return io_error(std::move(text));
}

std::string folder_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  if (slash == std::string::npos) return ".";
  return slash == 0 ? "/" : path.substr(0, slash);
}

// The lock says that no other process writes the file. It may have been renamed between open and
// lock; then it is another's finished file, and the name is free again.
bool same_file(int file, const std::string& path) {
  struct stat by_handle, by_name;
  return ::fstat(file, &by_handle) == 0 && ::stat(path.c_str(), &by_name) == 0 &&
         by_handle.st_ino == by_name.st_ino && by_handle.st_dev == by_name.st_dev;
}

Result<int> open_and_lock(const std::string& path, const std::string& partial_path) {
  for (;;) {
    const int file = ::open(partial_path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
    if (file < 0) return failure_of(path, "create", "name a folder that exists and is writable");
    if (::flock(file, LOCK_EX | LOCK_NB) != 0) {
      ::close(file);
      return io_error(path + ": another process is writing it; wait for it or name another file");
    }
    if (same_file(file, partial_path)) return file;
    ::close(file);
  }
}

}  // namespace

Result<std::unique_ptr<AtomicFile>> AtomicFile::create(const std::string& path) {
  struct stat info;
  if (::stat(path.c_str(), &info) == 0 && !S_ISREG(info.st_mode))
    return io_error(path + ": is no plain file; name another one");
  const std::string partial_path = path + ".partial";
  const Result<int> file = open_and_lock(path, partial_path);
  if (!file) return file.error();
  std::unique_ptr<AtomicFile> made(new AtomicFile(path, *file));
  if (::ftruncate(*file, 0) != 0) return made->failure("write");
  return made;
}

AtomicFile::AtomicFile(std::string path, int file)
    : path_(std::move(path)), partial_path_(path_ + ".partial"), file_(file) {
  buffer_.reserve(kBufferBytes);
}

AtomicFile::~AtomicFile() {
  if (file_ < 0) return;
  ::unlink(partial_path_.c_str());
  ::close(file_);
}

bool for_want_of_space(const Error& error) { return error.text.ends_with(kWantsSpace); }

Error AtomicFile::failure(const char* what) const { return failure_of(path_, what, ""); }

Status AtomicFile::write(std::span<const std::byte> data) {
  PVS_CHECK(file_ >= 0 && !is_complete_);
  size_bytes_ += data.size();
  while (!data.empty()) {
    const std::size_t n = std::min(data.size(), kBufferBytes - buffer_.size());
    buffer_.insert(buffer_.end(), data.begin(), data.begin() + static_cast<std::ptrdiff_t>(n));
    data = data.subspan(n);
    if (buffer_.size() < kBufferBytes) continue;
    if (Status status = flush(); !status) return status;
  }
  return {};
}

Status AtomicFile::flush() {
  for (std::size_t done = 0; done < buffer_.size();) {
    const ::ssize_t n = ::write(file_, buffer_.data() + done, buffer_.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return failure("write");
    done += static_cast<std::size_t>(n);
  }
  buffer_.clear();
  return {};
}

Status AtomicFile::complete() {
  if (is_complete_) return {};
  if (Status status = flush(); !status) return status;
  if (::fsync(file_) != 0) return failure("write");
  is_complete_ = true;
  return {};
}

Status AtomicFile::commit() {
  if (Status status = complete(); !status) return status;
  if (std::rename(partial_path_.c_str(), path_.c_str()) != 0) return failure("rename the new file");
  ::close(std::exchange(file_, -1));
  const std::string folder = folder_of(path_);
  const int handle = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (handle < 0) return failure("make its folder durable");
  // EINVAL: a file system that has no such notion.
  const bool durable = ::fsync(handle) == 0 || errno == EINVAL;
  const Error error = failure("make its folder durable");
  ::close(handle);
  return durable ? Status() : Status(error);
}

}  // namespace pvsfarm

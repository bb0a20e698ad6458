#include "common/base/file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>
#include <vector>

#include "common/base/atomic_file.hpp"

namespace pvsfarm {
namespace {

Error unreadable(const std::string& path) {
  return io_error(path + ": cannot be read: " + std::strerror(errno));
}

class FileHandle {
 public:
  explicit FileHandle(int fd) : fd_(fd) {}
  ~FileHandle() {
    if (fd_ >= 0) ::close(fd_);
  }
  FileHandle(const FileHandle&) = delete;
  FileHandle& operator=(const FileHandle&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

}  // namespace

Result<std::string> read_file(const std::string& path) {
  FileHandle file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) return unreadable(path);
  struct stat status {};
  if (::fstat(file.get(), &status) != 0) return unreadable(path);
  if (S_ISDIR(status.st_mode)) return io_error(path + ": cannot be read: it is a folder");
  std::string bytes;
  bytes.reserve(static_cast<std::size_t>(status.st_size));
  std::array<char, 65536> chunk;
  for (;;) {
    const ssize_t got = ::read(file.get(), chunk.data(), chunk.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return unreadable(path);
    if (got == 0) return bytes;
    bytes.append(chunk.data(), static_cast<std::size_t>(got));
  }
}

Status write_files(std::span<const FileToWrite> files) {
  std::vector<std::unique_ptr<AtomicFile>> parts;
  for (const FileToWrite& file : files) {
    auto part = AtomicFile::create(file.path);
    if (!part) return part.error();
    parts.push_back(std::move(*part));
    if (Status status = parts.back()->write(file.bytes); !status) return status;
    if (Status status = parts.back()->complete(); !status) return status;
  }
  for (const auto& part : parts)
    if (Status status = part->commit(); !status) return status;
  return {};
}

Status write_file(const std::string& path, std::string_view bytes) {
  return write_files(std::array{FileToWrite{path, bytes}});
}

}  // namespace pvsfarm

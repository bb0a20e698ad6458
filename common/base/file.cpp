#include "common/base/file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <vector>

namespace pvsfarm {
namespace {

Error system_error(const std::string& path, const char* what, int error) {
  return io_error(path + ": " + what + ": " + std::strerror(error));
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
  int close() {  // 0, or -1 with errno: a full disk may show up only here
    const int fd = fd_;
    fd_ = -1;
    return ::close(fd);
  }

 private:
  int fd_;
};

Status write_all(const std::string& path, const std::string& temporary, std::string_view bytes) {
  // The one thing that would make only the renaming fail, when other files are in place already.
  struct stat there {};
  if (::stat(path.c_str(), &there) == 0 && S_ISDIR(there.st_mode))
    return io_error(path + ": cannot be written: it is a folder");
  FileHandle file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  if (file.get() < 0) return system_error(path, "cannot be written", errno);
  while (!bytes.empty()) {
    const ssize_t written = ::write(file.get(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return system_error(path, "cannot be written", errno);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  if (::fsync(file.get()) != 0 || file.close() != 0)
    return system_error(path, "cannot be written", errno);
  return {};
}

}  // namespace

Result<std::string> read_file(const std::string& path) {
  FileHandle file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) return system_error(path, "cannot be read", errno);
  struct stat status {};
  if (::fstat(file.get(), &status) != 0) return system_error(path, "cannot be read", errno);
  if (S_ISDIR(status.st_mode)) return io_error(path + ": cannot be read: it is a folder");
  std::string bytes;
  bytes.reserve(static_cast<std::size_t>(status.st_size));
  std::array<char, 65536> chunk;
  for (;;) {
    const ssize_t got = ::read(file.get(), chunk.data(), chunk.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return system_error(path, "cannot be read", errno);
    if (got == 0) return bytes;
    bytes.append(chunk.data(), static_cast<std::size_t>(got));
  }
}

Status write_files(std::span<const FileToWrite> files) {
  std::vector<std::string> temporaries;
  Status status;
  for (const FileToWrite& file : files) {
    temporaries.push_back(file.path + ".tmp" + std::to_string(::getpid()));
    status = write_all(file.path, temporaries.back(), file.bytes);
    if (!status) break;
  }
  for (std::size_t i = 0; i < files.size() && status.ok(); ++i)
    if (std::rename(temporaries[i].c_str(), files[i].path.c_str()) != 0)
      status = system_error(files[i].path, "cannot be put in place", errno);
  if (!status)
    for (const std::string& temporary : temporaries) ::unlink(temporary.c_str());
  return status;
}

Status write_file(const std::string& path, std::string_view bytes) {
  return write_files(std::array{FileToWrite{path, bytes}});
}

}  // namespace pvsfarm

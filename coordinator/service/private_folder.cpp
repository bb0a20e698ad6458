#include "coordinator/service/private_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <utility>

namespace pvsfarm {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPattern = "pvsfarm-XXXXXX";  // the X become letters and digits
constexpr std::string_view kPrefix = kPattern.substr(0, 8);

// Locked, or -1: no folder of ours, or its process lives.
int lock_folder(const std::string& path) {
  const int folder = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (folder < 0) return -1;
  struct stat info;
  if (fstat(folder, &info) == 0 && info.st_uid == geteuid() &&
      flock(folder, LOCK_EX | LOCK_NB) == 0)
    return folder;
  close(folder);
  return -1;
}

// The files that a coordinator makes there, and then the folder, if that was all.
void remove_known(const std::string& path) {
  std::error_code none;
  for (fs::directory_iterator entry(path, none), end; !none && entry != end;
       entry.increment(none)) {
    const std::string name = entry->path().filename().string();
    // "scene.tmpPID" while it is written
    if (name == "farm" || name == "scene" || name.rfind("scene.tmp", 0) == 0)
      unlink(entry->path().c_str());
  }
  rmdir(path.c_str());
}

}  // namespace

Result<PrivateFolder> PrivateFolder::make() {
  std::error_code error;
  std::string path = fs::temp_directory_path(error).string();
  // The name of a local socket has 107 bytes at most.
  if (error || path.size() > 80) path = "/tmp";
  path.append("/").append(kPattern);
  if (mkdtemp(path.data()) == nullptr)
    return io_error(path + ": cannot make a temporary folder: " + std::strerror(errno));
  // Without a lock (a file system that has none) it merely stays if this process is killed.
  return PrivateFolder(path, lock_folder(path));
}

void PrivateFolder::remove_abandoned(const std::string& path) {
  const std::string name = fs::path(path).filename().string();
  if (name.rfind(kPrefix, 0) != 0 || name.size() != kPattern.size()) return;
  const int lock = lock_folder(path);
  if (lock < 0) return;
  remove_known(path);
  close(lock);
}

PrivateFolder::PrivateFolder(PrivateFolder&& other) noexcept
    : path_(std::exchange(other.path_, "")), lock_(std::exchange(other.lock_, -1)) {}

PrivateFolder::~PrivateFolder() {
  if (path_.empty()) return;
  remove_known(path_);
  if (lock_ >= 0) close(lock_);
}

}  // namespace pvsfarm

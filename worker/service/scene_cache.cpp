#include "worker/service/scene_cache.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

namespace pvsfarm {
namespace {
Error cannot(const std::string& path, const char* what) {
  return io_error(path + ": cannot " + what + ": " + std::strerror(errno));
}

// The file at `path`, if nobody else writes it and a part of `total_bytes` is in it; -1: neither.
// Whoever completes it renames it first and unlocks it then: what has another name is left alone.
int lock_part(const std::string& path, std::uint64_t total_bytes) {
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (fd < 0) return -1;
  struct stat held {
  }, named{};
  const bool ours = flock(fd, LOCK_EX | LOCK_NB) == 0 && fstat(fd, &held) == 0 &&
                    stat(path.c_str(), &named) == 0 && held.st_ino == named.st_ino;
  if (ours && static_cast<std::uint64_t>(held.st_size) < total_bytes) return fd;
  if (ours) unlink(path.c_str());  // whole, and yet not what it should be
  close(fd);
  return -1;
}

}  // namespace

std::string default_cache_folder() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache == '/')
    return std::string(cache) + "/pvsfarm";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home == '/')
    return std::string(home) + "/.cache/pvsfarm";
  std::error_code none;
  return (std::filesystem::temp_directory_path(none) / "pvsfarm-cache").string();
}

std::string SceneCache::path_of(const Digest& digest) const {
  return folder_ + "/" + digest.hex() + ".scene";
}

ScenePointer SceneCache::find(const Digest& digest, const std::string& hinted_path) const {
  for (const std::string& path : {hinted_path, path_of(digest)}) {
    std::error_code none;
    if (path.empty() || !std::filesystem::is_regular_file(path, none)) continue;
    const auto scene = Scene::map(path);
    if (scene && (*scene)->digest() == digest) return *scene;
  }
  return nullptr;
}

Result<std::uint64_t> SceneCache::begin(const Digest& digest, std::uint64_t total_bytes) {
  file_.reset();
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) return io_error(folder_ + ": cannot make the cache folder: " + error.message());
  temporary_ = path_of(digest) + ".part";
  int fd = lock_part(temporary_, total_bytes);
  if (fd < 0) {  // another worker of this machine fetches it, too
    temporary_ = path_of(digest) + "." + std::to_string(getpid()) + ".part";
    fd = open(temporary_.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  }
  if (fd < 0) return cannot(temporary_, "write the scene");
  const off_t have = lseek(fd, 0, SEEK_END);
  file_.reset(fdopen(fd, "r+b"));
  if (!file_ || have < 0) return cannot(temporary_, "write the scene");
  return static_cast<std::uint64_t>(have);
}

Result<bool> SceneCache::add(const BlobChunk& chunk) {
  if (std::fwrite(chunk.data.data(), 1, chunk.data.size(), file_.get()) != chunk.data.size())
    return cannot(temporary_, "write the scene");
  if (chunk.offset + chunk.data.size() < chunk.total_bytes) return false;
  if (std::fflush(file_.get()) != 0) return cannot(temporary_, "write the scene");
  const auto scene = Scene::map(temporary_);
  const std::string path = scene ? path_of((*scene)->digest()) : "";
  if (!scene || path != path_of(chunk.digest)) {
    unlink(temporary_.c_str());
    file_.reset();
    return invalid_input("the scene arrived damaged: its digest differs");
  }
  if (std::rename(temporary_.c_str(), path.c_str()) != 0) return cannot(path, "keep the scene");
  file_.reset();  // and with it the lock
  return true;
}

}  // namespace pvsfarm

#include "worker/service/scene_cache.hpp"

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

Status SceneCache::begin(const Digest& digest) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) return io_error(folder_ + ": cannot make the cache folder: " + error.message());
  temporary_ = path_of(digest) + "." + std::to_string(getpid()) + ".part";
  file_.reset(std::fopen(temporary_.c_str(), "wbe"));
  if (!file_) return cannot(temporary_, "write the scene");
  return {};
}

Result<bool> SceneCache::add(const BlobChunk& chunk) {
  if (std::fwrite(chunk.data.data(), 1, chunk.data.size(), file_.get()) != chunk.data.size())
    return cannot(temporary_, "write the scene");
  if (chunk.offset + chunk.data.size() < chunk.total_bytes) return false;
  const bool written = std::fflush(file_.get()) == 0;
  file_.reset();
  if (!written) return cannot(temporary_, "write the scene");
  const auto scene = Scene::map(temporary_);
  const std::string path = scene ? path_of((*scene)->digest()) : "";
  if (!scene || path != path_of(chunk.digest)) {
    unlink(temporary_.c_str());
    return invalid_input("the scene arrived damaged: its digest differs");
  }
  if (std::rename(temporary_.c_str(), path.c_str()) != 0) return cannot(path, "keep the scene");
  return true;
}

}  // namespace pvsfarm

// Scenes on the worker's disk, by content: found where the coordinator says, or in the cache, or
// fetched into it. Whatever the way, the digest decides.
#pragma once

#include <cstdio>
#include <memory>
#include <string>

#include "common/base/result.hpp"
#include "common/scene/scene.hpp"
#include "common/wire/messages.hpp"

namespace pvsfarm {

using ScenePointer = std::shared_ptr<const Scene>;

// $XDG_CACHE_HOME/pvsfarm, or ~/.cache/pvsfarm, or a folder for temporary files.
std::string default_cache_folder();

class SceneCache {
 public:
  explicit SceneCache(std::string folder) : folder_(std::move(folder)) {}

  // From the hinted path or the cache; null if it is in neither. A file that does not hold what
  // its name says is passed over.
  ScenePointer find(const Digest& digest, const std::string& hinted_path) const;

  // Begins a download into a temporary file, or goes on with one that was cut off, by this process
  // or another that is no more. Returns the bytes that are there. Errors: kIo.
  Result<std::uint64_t> begin(const Digest& digest, std::uint64_t total_bytes);
  // Chunks in order. True: that was the last, and the scene is in the cache.
  // Errors: kIo; kInvalidInput if the whole does not have the digest.
  Result<bool> add(const BlobChunk& chunk);

 private:
  std::string path_of(const Digest& digest) const;
  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  std::string folder_;
  std::string temporary_;
  std::unique_ptr<std::FILE, CloseFile> file_;
};

}  // namespace pvsfarm

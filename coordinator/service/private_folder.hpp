// A coordinator's folder for what the workers of its machine need: the scene and the socket.
//
// It stays locked while its process lives, so that the next coordinator of the same output can tell
// a folder that a killed one left behind.
#pragma once

#include <string>

#include "common/base/result.hpp"

namespace pvsfarm {

class PrivateFolder {
 public:
  // Among the temporary files. Errors: kIo.
  static Result<PrivateFolder> make();
  // Removes a folder of make() whose process is gone; does nothing in any other case.
  static void remove_abandoned(const std::string& path);

  PrivateFolder(PrivateFolder&& other) noexcept;
  PrivateFolder& operator=(PrivateFolder&&) = delete;
  ~PrivateFolder();  // removes it with its files

  const std::string& path() const { return path_; }
  std::string scene_path() const { return path_ + "/scene"; }
  std::string endpoint() const { return "ipc://" + path_ + "/farm"; }

 private:
  PrivateFolder(std::string path, int lock) : path_(std::move(path)), lock_(lock) {}

  std::string path_;
  int lock_;  // of the folder itself
};

}  // namespace pvsfarm

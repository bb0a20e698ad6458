// A file that appears complete, or not at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.hpp"

namespace pvsfarm {

// Of an AtomicFile's error: the disk, or a quota, is full. The same may succeed later.
bool for_want_of_space(const Error& error);

// Writes PATH.partial, then makes it durable and renames it to PATH. A writer that was killed
// leaves PATH.partial; the next one of the same path takes it over. Two at once: the second is
// refused. Errors: kIo, naming the path (missing folder, no rights, disk full, PATH is no plain
// file).
class AtomicFile {
 public:
  static Result<std::unique_ptr<AtomicFile>> create(const std::string& path);
  ~AtomicFile();  // without commit(): removes PATH.partial
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  Status write(std::span<const std::byte> data);
  Status write(std::string_view text) { return write(std::as_bytes(std::span(text))); }
  std::uint64_t size_bytes() const { return size_bytes_; }  // written so far
  // Flush and fsync, still under the other name: then only a failing rename can spoil commit().
  Status complete();
  Status commit();  // complete, rename, fsync of the folder; once

 private:
  AtomicFile(std::string path, int file);
  Status flush();
  Error failure(const char* what) const;

  std::string path_, partial_path_;
  int file_;
  bool is_complete_ = false;
  std::vector<std::byte> buffer_;
  std::uint64_t size_bytes_ = 0;
};

}  // namespace pvsfarm

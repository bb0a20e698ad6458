// Whole files: read at once, and written whole or not at all.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "common/base/result.hpp"

namespace pvsfarm {

// Errors: kIo, naming the file and what the system says.
Result<std::string> read_file(const std::string& path);

struct FileToWrite {
  std::string path;
  std::string_view bytes;
};

// Writes every file as an AtomicFile, and only when all are on the disk renames them into place in
// the order given. A reader never sees part of a file; a failure leaves what was there before and
// no temporary file. Errors: those of AtomicFile.
Status write_files(std::span<const FileToWrite> files);
Status write_file(const std::string& path, std::string_view bytes);

}  // namespace pvsfarm

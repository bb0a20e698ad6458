// PNG files: the only include of libpng is behind this.
#pragma once

#include <string>

#include "common/base/result.hpp"
#include "coordinator/picture/canvas.hpp"

namespace pvsfarm {

// Writes the picture whole or not at all. The same image gives the same bytes.
// Errors: kIo.
Status write_png(const Image& image, const std::string& path);

}  // namespace pvsfarm

#include "coordinator/picture/png_file.hpp"

#include <png.h>

#include "common/base/file.hpp"

namespace pvsfarm {

Status write_png(const Image& image, const std::string& path) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width_px);
  header.height = static_cast<png_uint_32>(image.height_px);
  header.format = PNG_FORMAT_RGB;
  png_alloc_size_t bytes = PNG_IMAGE_PNG_SIZE_MAX(header);
  std::string file(bytes, '\0');
  if (png_image_write_to_memory(&header, file.data(), &bytes, 0, image.rgb.data(), 0, nullptr) == 0)
    return runtime_error(path + ": cannot be encoded as PNG: " + header.message);
  file.resize(bytes);
  return write_file(path, file);
}

}  // namespace pvsfarm

#include "common/scene/gltf_extensions.hpp"

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

namespace pvsfarm {
namespace {

using nlohmann::json;

// Geometry that the reader decodes. Material and texture extensions never matter here.
constexpr std::array<const char*, 2> kDecoded = {"KHR_mesh_quantization",
                                                 "KHR_draco_mesh_compression"};

// The JSON chunk of a GLB (12 bytes of header, then length, "JSON", data); a .gltf is its own.
std::string json_text(const std::string& bytes) {
  if (bytes.compare(0, 4, "glTF") != 0) return bytes;
  std::uint32_t length = 0;
  if (bytes.size() < 20) return {};
  std::memcpy(&length, bytes.data() + 12, sizeof length);
  return bytes.substr(20, length);
}

bool harmless(const std::string& extension) {
  if (extension.find("_materials_") != std::string::npos ||
      extension.find("_texture_") != std::string::npos ||
      extension.find("_lights_") != std::string::npos)
    return true;
  for (const char* known : kDecoded)
    if (extension == known) return true;
  return false;
}

std::string mend(const std::string& extension) {
  if (extension == "EXT_meshopt_compression" || extension == "KHR_meshopt_compression")
    return "export it without mesh compression, or decode it with `gltf-transform cp IN OUT`";
  if (extension == "EXT_mesh_gpu_instancing") return "export every instance as a node of its own";
  return "export it without this extension";
}

}  // namespace

Status check_gltf_extensions(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  const json root = json::parse(json_text(bytes), nullptr, /*allow_exceptions=*/false);
  if (!root.is_object())
    return invalid_input(path + ": the glTF JSON is cut short or broken; export the file again");

  for (const char* list : {"extensionsRequired", "extensionsUsed"}) {
    const auto names = root.find(list);
    if (names == root.end() || !names->is_array()) continue;
    for (const json& name : *names) {
      if (!name.is_string()) continue;
      const std::string extension = name.get<std::string>();
      // Used but not required is a promise of a fall-back, except for instances, which are not
      // drawn at all by a reader that does not know them.
      const bool matters =
          std::strcmp(list, "extensionsRequired") == 0 || extension == "EXT_mesh_gpu_instancing";
      if (matters && !harmless(extension))
        return Error{ErrorKind::kUnsupported, path + ": needs the glTF extension " + extension +
                                                  ", which is not supported; " + mend(extension)};
    }
  }
  return {};
}

}  // namespace pvsfarm

// glTF 2.0, binary container: a header, a JSON chunk padded with spaces, a binary chunk.
#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "coordinator/generate/write_scene.hpp"

namespace pvsfarm {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF is little endian");

using nlohmann::json;

constexpr int kFloat = 5126, kUnsignedInt = 5125;           // component types
constexpr int kArrayBuffer = 34962, kElementArray = 34963;  // buffer view targets

template <class T>
void append_bytes(std::string& to, const T& value) {
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}

// Positions of all objects, then indices of all objects; one buffer view each.
struct Geometry {
  std::string positions, indices;
  json accessors = json::array();
};

void add_positions(Geometry& geometry, const SourceObject& object) {
  std::array<float, 3> lo, hi;
  lo.fill(std::numeric_limits<float>::infinity());
  hi.fill(-std::numeric_limits<float>::infinity());
  const std::size_t offset = geometry.positions.size();
  for (const Vec3& vertex : object.vertices) {
    const Vec3 turned = file_from_internal(UpAxis::kY, vertex);
    for (int a = 0; a < 3; ++a) {
      const float v = static_cast<float>(turned[a]) + 0.0f;  // -0 becomes 0
      lo[a] = std::min(lo[a], v);
      hi[a] = std::max(hi[a], v);
      append_bytes(geometry.positions, v);
    }
  }
  geometry.accessors.push_back({{"bufferView", 0},
                                {"byteOffset", offset},
                                {"componentType", kFloat},
                                {"count", object.vertices.size()},
                                {"type", "VEC3"},
                                {"min", lo},
                                {"max", hi}});
}

void add_indices(Geometry& geometry, const SourceObject& object) {
  const std::size_t offset = geometry.indices.size();
  for (const auto& triangle : object.triangles)
    for (const std::uint32_t v : triangle) append_bytes(geometry.indices, v);
  geometry.accessors.push_back({{"bufferView", 1},
                                {"byteOffset", offset},
                                {"componentType", kUnsignedInt},
                                {"count", object.triangles.size() * 3},
                                {"type", "SCALAR"}});
}

json node_of(const SourceObject& object, std::size_t mesh) {
  json node{{"name", object.name}, {"mesh", mesh}};
  if (!object.occluder) node["extras"]["occluder"] = false;
  if (!object.occludee) node["extras"]["occludee"] = false;
  if (object.dynamic) node["extras"]["dynamic"] = true;
  return node;
}

void append_chunk(std::string& file, std::string_view type, std::string data, char padding) {
  while (data.size() % 4 != 0) data += padding;
  append_bytes(file, static_cast<std::uint32_t>(data.size()));
  file += type;
  file += data;
}

// Beyond, float32 tells no millimetres apart.
bool is_too_far(const SourceObject& object) {
  return std::any_of(object.vertices.begin(), object.vertices.end(), [](const Vec3& v) {
    return std::max(std::abs(v.x), std::abs(v.y)) > kMaxCoordinate_m;
  });
}

}  // namespace

Result<std::string> glb_bytes(const SceneSource& source) {
  Geometry geometry;
  json nodes = json::array(), meshes = json::array(), roots = json::array();
  for (const SourceObject& object : source.objects) {
    if (is_too_far(object))
      return Error{ErrorKind::kCommandLine,
                   "too far from the origin for the float32 of a GLB: name it .obj"};
    const std::size_t number = nodes.size();
    add_positions(geometry, object);
    add_indices(geometry, object);
    nodes.push_back(node_of(object, number));
    roots.push_back(number);
    const json primitive{{"attributes", {{"POSITION", 2 * number}}},
                         {"indices", 2 * number + 1},
                         {"material", object.two_sided ? 0 : 1}};
    meshes.push_back({{"name", object.name}, {"primitives", json::array({primitive})}});
  }
  const std::size_t split = geometry.positions.size();
  const std::size_t total = split + geometry.indices.size();
  const json document{{"asset", {{"version", "2.0"}, {"generator", "pvsfarm"}}},
                      {"scene", 0},
                      {"scenes", json::array({{{"nodes", std::move(roots)}}})},
                      {"nodes", std::move(nodes)},
                      {"meshes", std::move(meshes)},
                      {"accessors", std::move(geometry.accessors)},
                      {"materials", json::array({{{"name", "two-sided"}, {"doubleSided", true}},
                                                 {{"name", "one-sided"}, {"doubleSided", false}}})},
                      {"bufferViews", json::array({{{"buffer", 0},
                                                    {"byteOffset", 0},
                                                    {"byteLength", split},
                                                    {"byteStride", 12},
                                                    {"target", kArrayBuffer}},
                                                   {{"buffer", 0},
                                                    {"byteOffset", split},
                                                    {"byteLength", total - split},
                                                    {"target", kElementArray}}})},
                      {"buffers", json::array({{{"byteLength", total}}})}};
  const std::string text = document.dump();
  constexpr std::size_t kOverhead = 12 + 2 * (8 + 3);  // header, chunk headers, padding
  if (total + text.size() + kOverhead > std::numeric_limits<std::uint32_t>::max())
    return Error{ErrorKind::kUnsupported, "a GLB file holds 4 GiB; write an OBJ file instead"};

  std::string chunks;
  append_chunk(chunks, "JSON", text, ' ');
  append_chunk(chunks, std::string_view("BIN\0", 4), geometry.positions + geometry.indices, '\0');
  std::string file = "glTF";
  append_bytes(file, std::uint32_t{2});
  append_bytes(file, static_cast<std::uint32_t>(12 + chunks.size()));
  return file + chunks;
}

}  // namespace pvsfarm

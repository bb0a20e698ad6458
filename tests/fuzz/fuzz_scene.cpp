// Scene files, and bundles as a worker fetches them. The first byte says which.
#include <fstream>

#include "common/base/file.hpp"
#include "common/scene/import.hpp"
#include "common/scene/scene.hpp"
#include "common/scene/scene_build.hpp"
#include "coordinator/generate/generate.hpp"
#include "coordinator/generate/write_scene.hpp"
#include "tests/fuzz/driver.hpp"
#include "tests/unit/store_samples.hpp"

namespace pvsfarm::fuzz {

#if defined(PVSFARM_FUZZ_BUNDLE)
const char* const kTarget = "bundle";
#else
const char* const kTarget = "scene";
#endif
const std::size_t kMaxInput = 32 << 10;

namespace {

constexpr const char* kObj =
    "mtllib none.mtl\no wall\nv 0 0 0\nv 1 0 0\nv 1 0 2\nv 0 0 2\nvn 0 1 0\nf 1//1 2//1 3//1 4//1\n"
    "g other\nv 5 5 5\nv 6 5 5\nv 5 6 5\nusemtl m\nf -3 -2 -1\n";
constexpr const char* kPly =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
constexpr const char* kGltf =
    R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,)"
    R"("name":"a","translation":[1,2,3],"extras":{"occluder":true}}],)"
    R"("meshes":[{"primitives":[{"attributes":)"
    R"({"POSITION":1},"indices":0}]}],"accessors":[{"bufferView":0,"componentType":5123,"count":3,)"
    R"("type":"SCALAR"},{"bufferView":1,"componentType":5126,"count":3,"type":"VEC3",)"
    R"("min":[0,0,0],"max":[1,1,0]}],"bufferViews":[)"
    R"({"buffer":0,"byteLength":6},{"buffer":0,"byteOffset":8,)"
    R"("byteLength":36}],"buffers":[{"byteLength":44,"uri":"data:application/octet-stream;base64,)"
    R"(AAABAAIAAAAAAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAAAAAACAPwAAAAA="}]})";
constexpr const char* kEndings[] = {".obj", ".ply", ".gltf", ".glb"};

GeneratedScene small_scene() { return generate_forest({.trees = 1, .leaves = 2}).value(); }

}  // namespace

#if defined(PVSFARM_FUZZ_BUNDLE)

std::vector<Input> seeds() {
  const auto scene = build_scene(small_scene().source).value();
  Input input;
  for (const std::byte b : scene->bundle()) input.push_back(static_cast<std::uint8_t>(b));
  return {input};
}

void run(std::span<const std::uint8_t> input) {
  const auto bytes = std::as_bytes(input);
  const auto scene = Scene::from_bytes({bytes.begin(), bytes.end()});
  if (!scene) return;
  PVS_CHECK((*scene)->object_count() > 0);
}

#else

std::vector<Input> seeds() {
  const std::string glb = glb_bytes(small_scene().source).value();
  return {input_of(std::string(1, '\0') + kObj), input_of(std::string(1, '\1') + kPly),
          input_of(std::string(1, '\2') + kGltf), input_of(std::string(1, '\3') + glb),
          input_of(std::string(1, '\0') + obj_text(small_scene().source).substr(0, 4000))};
}

void run(std::span<const std::uint8_t> input) {
  static const TempFolder folder;
  if (input.empty()) return;
  const std::string path = folder.file(std::string("scene") + kEndings[input[0] % 4]);
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(input.data()) + 1,
             static_cast<std::streamsize>(input.size() - 1));
  auto imported = import_scene({.scene_path = path});
  if (!imported) return;
  (void)build_scene(std::move(imported->source));
}

#endif

}  // namespace pvsfarm::fuzz

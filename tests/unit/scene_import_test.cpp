#include "common/scene/import.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "common/geometry/box.hpp"

namespace pvsfarm {
namespace {

// Files of one test, removed with it.
class SceneImport : public testing::Test {
 protected:
  SceneImport()
      : folder_(std::filesystem::temp_directory_path() /
                ("pvsfarm_import_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~SceneImport() override { std::filesystem::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return (folder_ / name).string();
  }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  static void expect_refused(const ImportOptions& options, ErrorKind kind,
                             const std::string& says) {
    const auto imported = import_scene(options);
    ASSERT_FALSE(imported.ok()) << says;
    EXPECT_EQ(imported.error().kind, kind) << imported.error().text;
    EXPECT_NE(imported.error().text.find(says), std::string::npos) << imported.error().text;
    EXPECT_EQ(imported.error().text.find('\n'), std::string::npos);
  }

 private:
  std::filesystem::path folder_;
};

constexpr char kTwoObjects[] =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 5\nv 1 0 5\nv 1 1 5\n"
    "o floor\nf 1 2 3 4\n"
    "o roof\nf 5 6 7\n";

// One triangle (0 0 0, 1 0 0, 0 1 0) as float32, base64, of 36 bytes.
constexpr char kTriangleBuffer[] =
    "data:application/octet-stream;base64,"
    "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";

constexpr char kPlyTriangle[] =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

// `nodes`, `extra` and `materials` are JSON; mesh 0 has material 0, mesh 1 has material 1,
// mesh 2 has both.
std::string gltf(const std::string& nodes, const std::string& materials = "[{},{}]",
                 const std::string& extra = "") {
  const std::string primitive = R"({"attributes":{"POSITION":0},"material":)";
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":)" + nodes +
         R"(,"materials":)" + materials + R"(,"meshes":[{"primitives":[)" + primitive +
         R"(0}]},{"primitives":[)" + primitive + R"(1}]},{"primitives":[)" + primitive + "0}," +
         primitive +
         R"(1}]}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",)"
         R"("min":[0,0,0],"max":[1,1,0]}],"bufferViews":[{"buffer":0,"byteLength":36}],)"
         R"("buffers":[{"byteLength":36,"uri":")" +
         kTriangleBuffer + "\"}]" + extra + "}";
}

}  // namespace

TEST_F(SceneImport, obj_objects_keep_names_order_and_numbers) {
  const auto imported = import_scene({.scene_path = write("two.obj", kTwoObjects)}).value();
  ASSERT_EQ(imported.source.objects.size(), 2u);
  const SourceObject& floor = imported.source.objects[0];
  EXPECT_EQ(floor.name, "floor");
  EXPECT_EQ(floor.triangles.size(), 2u);
  EXPECT_TRUE(floor.occluder && floor.occludee && floor.two_sided && !floor.dynamic);
  EXPECT_EQ(imported.source.objects[1].name, "roof");
  EXPECT_EQ(imported.source.objects[1].vertices[0].z, 5);
  EXPECT_EQ(imported.source.file_up, UpAxis::kZ);
  EXPECT_TRUE(imported.warnings.empty());
}

TEST_F(SceneImport, groups_are_objects_and_materials_are_not) {
  const auto imported =
      import_scene({.scene_path = write("groups.obj",
                                        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
                                        "g wall\nusemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n"
                                        "g door\nusemtl a\nf 1 2 4\n")})
          .value();
  ASSERT_EQ(imported.source.objects.size(), 2u);
  EXPECT_EQ(imported.source.objects[0].name, "wall");
  EXPECT_EQ(imported.source.objects[0].triangles.size(), 2u);
  EXPECT_EQ(imported.source.objects[1].name, "door");
}

TEST_F(SceneImport, a_single_object_gets_a_warning_that_says_what_to_export) {
  const auto imported =
      import_scene({.scene_path = write("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")})
          .value();
  ASSERT_EQ(imported.warnings.size(), 1u);
  EXPECT_NE(imported.warnings[0].find("single object"), std::string::npos);
}

TEST_F(SceneImport, tags_apply_in_file_order_and_must_fit) {
  const std::string scene = write("two.obj", kTwoObjects);
  const std::string tags =
      write("tags.json", R"({"objects":[{"name":"floor","occluder":false},)"
                         R"({"name":"roof","occludee":false,"dynamic":true}]})");
  const auto imported = import_scene({.scene_path = scene, .tags_path = tags}).value();
  EXPECT_FALSE(imported.source.objects[0].occluder);
  EXPECT_TRUE(imported.source.objects[0].occludee);
  EXPECT_FALSE(imported.source.objects[1].occludee);
  EXPECT_TRUE(imported.source.objects[1].dynamic);

  const auto with = [&](const char* json) {
    return ImportOptions{.scene_path = scene, .tags_path = write("bad.json", json)};
  };
  const ErrorKind invalid = ErrorKind::kInvalidInput;
  expect_refused(with(R"({"objects":[{"name":"floor"}]})"), invalid, "1 entries");
  expect_refused(with(R"({"objects":[{"name":"roof"},{"name":"floor"}]})"), invalid, "entry 0");
  expect_refused(with(R"({"objects":[{},{"occluder":1}]})"), invalid, "entry 1");
  expect_refused(with("{"), invalid, "not a tags file");
  expect_refused({.scene_path = scene, .tags_path = path("none.json")}, invalid, "none.json");
}

TEST_F(SceneImport, occluder_only_geometry_comes_after_the_scene) {
  const auto imported = import_scene({.scene_path = write("two.obj", kTwoObjects),
                                      .occluders_path = write("block.obj", kTwoObjects)})
                            .value();
  ASSERT_EQ(imported.source.objects.size(), 4u);
  EXPECT_TRUE(imported.source.objects[1].occludee);
  EXPECT_FALSE(imported.source.objects[2].occludee);
  EXPECT_TRUE(imported.source.objects[2].occluder);
}

TEST_F(SceneImport, transparent_obj_material_never_occludes) {
  write("glass.mtl", "newmtl glass\nd 0.3\nnewmtl brick\nd 1\n");
  const auto imported =
      import_scene({.scene_path = write("glass.obj",
                                        "mtllib glass.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\n"
                                        "o pane\nusemtl glass\nf 1 2 3\n"
                                        "o wall\nusemtl brick\nf 1 2 3\n")})
          .value();
  ASSERT_EQ(imported.source.objects.size(), 2u);
  EXPECT_FALSE(imported.source.objects[0].occluder);
  EXPECT_TRUE(imported.source.objects[1].occluder);
}

TEST_F(SceneImport, gltf_is_y_up_and_nested_transforms_apply) {
  const std::string nodes =
      R"([{"name":"top","translation":[10,20,30],"children":[1,2]},)"
      R"({"name":"a","mesh":0,"scale":[2,2,2]},{"name":"b","mesh":2,"scale":[-1,1,1]}])";
  const auto imported = import_scene({.scene_path = write("t.gltf", gltf(nodes))}).value();
  ASSERT_EQ(imported.source.objects.size(), 2u);
  const SourceObject& a = imported.source.objects[0];
  EXPECT_EQ(imported.source.file_up, UpAxis::kY);
  EXPECT_EQ(a.name, "a");
  // File (10,20,30) + 2 * ((0,0,0), (1,0,0), (0,1,0)), then y up to z up.
  ASSERT_EQ(a.triangles.size(), 1u);
  EXPECT_EQ(a.vertices[a.triangles[0][0]], Vec3(10, -30, 20));
  EXPECT_EQ(a.vertices[a.triangles[0][1]], Vec3(12, -30, 20));
  EXPECT_EQ(a.vertices[a.triangles[0][2]], Vec3(10, -30, 22));
  // One object for both materials; a mirror turns the winding, so the front stays the front.
  const SourceObject& b = imported.source.objects[1];
  ASSERT_EQ(b.triangles.size(), 2u);
  const auto& t = b.triangles[0];
  const Vec3 normal =
      cross(b.vertices[t[1]] - b.vertices[t[0]], b.vertices[t[2]] - b.vertices[t[0]]);
  EXPECT_LT(normal.y, 0);  // towards +z of the file, as drawn before the mirror
  const auto z_up = import_scene({.scene_path = path("t.gltf"), .up = UpAxis::kZ}).value();
  EXPECT_EQ(z_up.source.objects[0].vertices[0], Vec3(10, 20, 30));
}

TEST_F(SceneImport, gltf_alpha_mode_sides_and_extras_are_kept) {
  const std::string nodes =
      R"([{"name":"root","children":[1,2,3]},{"name":"leaf","mesh":0},{"name":"wall","mesh":1},)"
      R"({"name":"car","mesh":1,"extras":{"dynamic":true,"occluder":false}}])";
  const std::string materials = R"([{"alphaMode":"MASK"},{"doubleSided":true}])";
  const auto imported =
      import_scene({.scene_path = write("m.gltf", gltf(nodes, materials))}).value();
  ASSERT_EQ(imported.source.objects.size(), 3u);
  EXPECT_FALSE(imported.source.objects[0].occluder);
  EXPECT_FALSE(imported.source.objects[0].two_sided);
  EXPECT_TRUE(imported.source.objects[1].occluder);
  EXPECT_TRUE(imported.source.objects[1].two_sided);
  EXPECT_TRUE(imported.source.objects[2].dynamic);
  EXPECT_FALSE(imported.source.objects[2].occluder);
}

TEST_F(SceneImport, compressed_or_instanced_gltf_is_said_to_be_unsupported) {
  const std::string nodes = R"([{"mesh":0}])";
  for (const char* extension : {"EXT_meshopt_compression", "EXT_mesh_gpu_instancing"}) {
    const std::string list = "[\"" + std::string(extension) + "\"]";
    expect_refused({.scene_path = write("x.gltf", gltf(nodes, "[{},{}]",
                                                       ",\"extensionsUsed\":" + list +
                                                           ",\"extensionsRequired\":" + list))},
                   ErrorKind::kUnsupported, extension);
  }
  const auto harmless = import_scene(
      {.scene_path = write(
           "y.gltf", gltf(nodes, "[{},{}]", R"(,"extensionsUsed":["KHR_materials_unlit"])"))});
  EXPECT_TRUE(harmless.ok());
}

TEST_F(SceneImport, bad_files_are_refused_in_one_line) {
  const ErrorKind invalid = ErrorKind::kInvalidInput;
  expect_refused({.scene_path = path("none.obj")}, invalid, "none.obj");
  std::filesystem::create_directories(path("folder.obj"));
  expect_refused({.scene_path = path("folder.obj")}, invalid, "folder.obj");
  expect_refused({.scene_path = write("scene.fbx", "x")}, ErrorKind::kUnsupported, ".glb");
  expect_refused({.scene_path = write("empty.obj", "")}, invalid, "empty.obj");
  expect_refused({.scene_path = write("points.obj", "v 0 0 0\nv 1 0 0\np 1 2\n")}, invalid,
                 "points.obj");
  expect_refused({.scene_path = write("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")},
                 invalid, "range.obj");
  expect_refused({.scene_path = write("nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\no a\nf 1 2 3\n")},
                 invalid, "not a number");
  expect_refused({.scene_path = write("cut.glb", "glTF\x02")}, invalid, "cut.glb");
  expect_refused({.scene_path = write("junk.ply", "ply\nformat ascii 1.0\n")}, invalid, "junk.ply");
}

TEST_F(SceneImport, every_truncation_of_a_file_is_an_error_or_a_smaller_scene) {
  const std::string whole = gltf(R"([{"mesh":0}])");
  for (std::size_t size = 0; size < whole.size(); size += 7)
    EXPECT_FALSE(import_scene({.scene_path = write("cut.gltf", whole.substr(0, size))}).ok());
  for (std::size_t size = 0; size < sizeof kTwoObjects; ++size)
    if (const auto cut = import_scene({.scene_path = write("cut.obj", {kTwoObjects, size})});
        cut.ok()) {
      EXPECT_LE(cut->source.objects.size(), 2u);
    }
  const std::string ply(kPlyTriangle);
  for (std::size_t size = 0; size < ply.size() - 8; ++size)
    EXPECT_FALSE(import_scene({.scene_path = write("cut.ply", ply.substr(0, size))}).ok()) << size;
  // Nor where the line that should end it says more.
  std::string longer = ply;
  longer.insert(longer.find("end_header") + 10, "Z");
  EXPECT_FALSE(import_scene({.scene_path = write("longer.ply", longer)}).ok());
  EXPECT_TRUE(import_scene({.scene_path = write("whole.ply", ply)}).ok());
}

// The real scenes, where they are: every object of the tags file, in its order.
TEST(RealScenes, objects_are_those_of_the_tags_file) {
  const char* from_environment = std::getenv("PVSFARM_SCENES");
  const std::filesystem::path folder =
      from_environment != nullptr ? from_environment : PVSFARM_SOURCE_DIR "/../shared/scenes";
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << "no real scenes at " << folder;
  int scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::filesystem::path scene = entry.path() / "scene.obj";
    if (!std::filesystem::exists(scene)) continue;
    const std::filesystem::path blockers = entry.path() / "blockers.obj";
    const auto imported = import_scene(
        {.scene_path = scene.string(),
         .tags_path = (entry.path() / "tags.json").string(),
         .occluders_path = std::filesystem::exists(blockers) ? blockers.string() : ""});
    EXPECT_TRUE(imported.ok()) << imported.error().text;
    ++scenes;
  }
  EXPECT_GT(scenes, 0);
}

}  // namespace pvsfarm

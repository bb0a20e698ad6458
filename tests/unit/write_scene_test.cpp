#include "coordinator/generate/write_scene.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/base/file.hpp"
#include "coordinator/generate/generate.hpp"
#include "coordinator/generate/placement.hpp"

namespace pvsfarm {
namespace {

namespace fs = std::filesystem;

class WriteScene : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "pvsfarm-write-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::size_t file_count() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), {}));
  }

  fs::path folder_;
  const GeneratedScene city_ = generate_city({.blocks = 1}).value();
};

TEST_F(WriteScene, writes_three_files_and_leaves_no_other) {
  ASSERT_TRUE(write_scene(city_, (folder_ / "a.b.obj").string()).ok());
  EXPECT_TRUE(fs::exists(folder_ / "a.b.obj"));
  EXPECT_TRUE(fs::exists(folder_ / "a.b.cells.json"));
  EXPECT_TRUE(fs::exists(folder_ / "a.b.tags.json"));
  EXPECT_EQ(file_count(), 3u);
}

TEST_F(WriteScene, writes_nothing_when_one_file_cannot_be_written) {
  fs::create_directory(folder_ / "a.obj");  // the scene's place is taken by a folder
  for (const fs::path& path : {folder_ / "a.obj", folder_ / "none" / "a.obj"}) {
    const Status status = write_scene(city_, path.string());
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().kind, ErrorKind::kIo);
    EXPECT_NE(status.error().text.find("a."), std::string::npos);
    EXPECT_EQ(file_count(), 1u);  // the folder
  }
}

TEST_F(WriteScene, refuses_another_ending) {
  const Status status = write_scene(city_, (folder_ / "a.fbx").string());
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::kCommandLine);
  EXPECT_NE(status.error().text.find("a.fbx"), std::string::npos);
  EXPECT_EQ(file_count(), 0u);
}

TEST_F(WriteScene, obj_reads_back_bit_for_bit) {
  std::istringstream text(obj_text(city_.source));
  std::vector<Vec3> vertices;
  std::size_t object = 0, triangle = 0, first = 0;
  for (std::string line; std::getline(text, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "o") {
      if (object > 0) first += city_.source.objects[object - 1].vertices.size();
      words >> word;
      ASSERT_EQ(word, city_.source.objects[object++].name);
      triangle = 0;
    } else if (word == "v") {
      ASSERT_EQ(line.find_first_of("eE"), std::string::npos);
      Vec3 v;
      words >> v.x >> v.y >> v.z;
      vertices.push_back(v);
    } else if (word == "f") {
      const auto& expected = city_.source.objects[object - 1].triangles[triangle++];
      for (const std::uint32_t index : expected) {
        std::size_t got = 0;
        words >> got;
        ASSERT_EQ(got, first + index + 1);
      }
    }
  }
  std::vector<Vec3> expected;
  for (const SourceObject& o : city_.source.objects)
    expected.insert(expected.end(), o.vertices.begin(), o.vertices.end());
  EXPECT_EQ(vertices, expected);
  EXPECT_EQ(object, city_.source.objects.size());
}

TEST_F(WriteScene, glb_holds_the_same_scene_turned_y_up) {
  const std::string glb = glb_bytes(city_.source).value();
  const auto u32 = [&](std::size_t at) {
    std::uint32_t v;
    std::memcpy(&v, glb.data() + at, 4);
    return v;
  };
  ASSERT_EQ(glb.substr(0, 4), "glTF");
  EXPECT_EQ(u32(4), 2u);
  ASSERT_EQ(u32(8), glb.size());
  const std::size_t json_bytes = u32(12), binary = 20 + json_bytes + 8;
  EXPECT_EQ(json_bytes % 4, 0u);
  EXPECT_EQ(glb.substr(20 + json_bytes + 4, 4), std::string("BIN\0", 4));
  const nlohmann::json document = nlohmann::json::parse(glb.substr(20, json_bytes));
  ASSERT_EQ(document["nodes"].size(), city_.source.objects.size());
  for (std::size_t i = 0; i < city_.source.objects.size(); ++i) {
    const SourceObject& object = city_.source.objects[i];
    const auto& node = document["nodes"][i];
    EXPECT_EQ(node["name"], object.name);
    EXPECT_EQ(node.contains("extras"), !object.occluder);
    const auto& primitive = document["meshes"][node["mesh"].get<int>()]["primitives"][0];
    const auto& accessor = document["accessors"][primitive["attributes"]["POSITION"].get<int>()];
    ASSERT_EQ(accessor["count"], object.vertices.size());
    std::size_t at = binary + accessor["byteOffset"].get<std::size_t>();
    for (const Vec3& v : object.vertices) {
      float p[3];
      std::memcpy(p, glb.data() + at, sizeof p);
      at += sizeof p;
      ASSERT_EQ(internal_from_file(UpAxis::kY, {p[0], p[1], p[2]}), v);
    }
  }
}

TEST_F(WriteScene, cells_and_tags_are_in_the_format_of_the_inputs) {
  const nlohmann::json cells = nlohmann::json::parse(cells_json(city_.cells));
  EXPECT_EQ(cells["units"], "m");
  EXPECT_EQ(cells["up"], "z");
  ASSERT_EQ(cells["cells"].size(), city_.cells.size());
  EXPECT_EQ(cells["cells"][3]["id"], city_.cells[3].id);
  EXPECT_EQ(cells["cells"][3]["aabb"][1][2].get<double>(), city_.cells[3].cell.hi.z);
  const nlohmann::json tags = nlohmann::json::parse(tags_json(city_.source));
  ASSERT_EQ(tags["objects"].size(), city_.source.objects.size());
  EXPECT_EQ(tags["objects"][0]["name"], "ground_0_0");
  EXPECT_EQ(tags["objects"][0]["occluder"], false);
  EXPECT_EQ(tags["objects"][1]["occluder"], true);
}

TEST_F(WriteScene, a_turned_and_moved_scene_keeps_its_cells_along_its_streets) {
  GeneratedScene askew = generate_city({.blocks = 1}).value();
  ASSERT_TRUE(place(askew, {.rotate_deg = 30, .move_m = {450'000, -5'400'000}}));
  const fs::path path = folder_ / "askew.obj";
  ASSERT_TRUE(write_scene(askew, path.string()));
  const auto cells = read_cells((folder_ / "askew.cells.json").string());
  ASSERT_TRUE(cells.ok()) << cells.error().text;
  ASSERT_EQ(cells->size(), city_.cells.size());
  const double c = std::sqrt(0.75), s = 0.5;
  for (std::size_t i = 0; i < cells->size(); ++i) {
    const Cell &cell = (*cells)[i].cell, &before = city_.cells[i].cell;
    EXPECT_NEAR(cell.axes[0].x, c, 1e-15);
    EXPECT_NEAR(cell.axes[0].y, s, 1e-15);
    EXPECT_EQ(cell.half(), before.half());
    const Vec3 at = before.center();
    EXPECT_NEAR(cell.center().x, c * at.x - s * at.y + 450'000, 1e-6);
    EXPECT_NEAR(cell.center().y, s * at.x + c * at.y - 5'400'000, 1e-6);
    EXPECT_EQ(cell.center().z, at.z);
  }
  const Vec3 was = city_.source.objects[1].vertices[0], is = askew.source.objects[1].vertices[0];
  EXPECT_NEAR(is.x, c * was.x - s * was.y + 450'000, 1e-6);
  EXPECT_NEAR(is.y, s * was.x + c * was.y - 5'400'000, 1e-6);
  const Status glb = write_scene(askew, (folder_ / "askew.glb").string());
  ASSERT_FALSE(glb) << "float32 holds half metres there";
  EXPECT_EQ(glb.error().kind, ErrorKind::kCommandLine);
}

TEST_F(WriteScene, quarter_turns_are_exact_and_four_of_them_are_none) {
  GeneratedScene turned = generate_city({.blocks = 1}).value();
  for (const double degrees : {90.0, -270.0, 450.0, 90.0}) {
    ASSERT_TRUE(place(turned, {.rotate_deg = degrees}));
    EXPECT_EQ(turned.cells[0].cell.axes, Cell{}.axes);
  }
  EXPECT_EQ(obj_text(turned.source), obj_text(city_.source));
  EXPECT_EQ(cells_json(turned.cells), cells_json(city_.cells));
}

TEST_F(WriteScene, a_scene_is_not_moved_out_of_sight_of_double_precision) {
  GeneratedScene scene = generate_city({.blocks = 1}).value();
  EXPECT_FALSE(place(scene, {.move_m = {1e9, 0}}));
  EXPECT_FALSE(place(scene, {.rotate_deg = std::nan("")}));
}

TEST_F(WriteScene, gives_the_same_bytes_for_the_same_seed) {
  const GeneratedScene again = generate_city({.blocks = 1}).value();
  EXPECT_EQ(obj_text(city_.source), obj_text(again.source));
  EXPECT_EQ(glb_bytes(city_.source).value(), glb_bytes(again.source).value());
  EXPECT_EQ(cells_json(city_.cells), cells_json(again.cells));
}

}  // namespace
}  // namespace pvsfarm

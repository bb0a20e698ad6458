// A generated scene, written as OBJ and as GLB and read back, is the scene that was generated.
#include <gtest/gtest.h>

#include <filesystem>

#include "common/cells/cell_source.hpp"
#include "common/scene/import.hpp"
#include "common/scene/scene_build.hpp"
#include "coordinator/generate/generate.hpp"
#include "coordinator/generate/write_scene.hpp"

namespace pvsfarm {
namespace {

namespace fs = std::filesystem;

struct Generator {
  const char* name;
  Result<GeneratedScene> (*make)();
};
std::ostream& operator<<(std::ostream& out, const Generator& g) { return out << g.name; }

class RoundTrip : public testing::TestWithParam<Generator> {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "pvsfarm-trip-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }

  SceneSource through(const GeneratedScene& scene, const std::string& file, bool with_tags) {
    const std::string path = (folder_ / file).string();
    const Status written = write_scene(scene, path);
    EXPECT_TRUE(written.ok());
    const auto imported =
        import_scene({.scene_path = path, .tags_path = with_tags ? tags_path() : std::string()});
    EXPECT_TRUE(imported.ok()) << (imported.ok() ? "" : imported.error().text);
    EXPECT_TRUE(imported->warnings.empty()) << imported->warnings.front();
    return imported->source;
  }
  std::string tags_path() const { return (folder_ / "scene.tags.json").string(); }

  fs::path folder_;
};

// The corners of every triangle in order: readers may renumber vertices, but not move or turn.
std::vector<std::array<Vec3, 3>> corners_of(const SourceObject& object) {
  std::vector<std::array<Vec3, 3>> corners;
  for (const auto& t : object.triangles) {
    std::array<Vec3, 3> corner{object.vertices[t[0]], object.vertices[t[1]], object.vertices[t[2]]};
    const auto less = [](const Vec3& a, const Vec3& b) {
      return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
    };
    std::rotate(corner.begin(), std::min_element(corner.begin(), corner.end(), less), corner.end());
    corners.push_back(corner);
  }
  return corners;
}

void expect_same(const SceneSource& made, const SceneSource& read) {
  ASSERT_EQ(made.objects.size(), read.objects.size());
  for (std::size_t i = 0; i < made.objects.size(); ++i) {
    const SourceObject &a = made.objects[i], &b = read.objects[i];
    ASSERT_EQ(a.name, b.name);
    ASSERT_EQ(corners_of(a), corners_of(b)) << a.name;
    ASSERT_EQ(a.occluder, b.occluder) << a.name;
    ASSERT_EQ(a.occludee, b.occludee) << a.name;
    ASSERT_EQ(a.dynamic, b.dynamic) << a.name;
    ASSERT_EQ(a.two_sided, b.two_sided) << a.name;
  }
}

TEST_P(RoundTrip, through_obj_and_tags_gives_the_scene_back) {
  const GeneratedScene scene = GetParam().make().value();
  const SceneSource read = through(scene, "scene.obj", true);
  expect_same(scene.source, read);
  EXPECT_EQ(read.file_up, UpAxis::kZ);
}

TEST_P(RoundTrip, through_glb_gives_the_scene_back_without_tags) {
  const GeneratedScene scene = GetParam().make().value();
  const SceneSource read = through(scene, "scene.glb", false);
  expect_same(scene.source, read);
  EXPECT_EQ(read.file_up, UpAxis::kY);
}

TEST_P(RoundTrip, gives_the_cells_back_bit_for_bit) {
  const GeneratedScene scene = GetParam().make().value();
  through(scene, "scene.glb", true);
  const auto cells = read_cells((folder_ / "scene.cells.json").string());
  ASSERT_TRUE(cells.ok()) << cells.error().text;
  ASSERT_EQ(cells->size(), scene.cells.size());
  for (std::size_t i = 0; i < cells->size(); ++i) {
    ASSERT_EQ((*cells)[i].id, scene.cells[i].id);
    ASSERT_EQ((*cells)[i].cell, scene.cells[i].cell);
  }
}

TEST_P(RoundTrip, can_be_built_and_has_occluders) {
  const GeneratedScene scene = GetParam().make().value();
  const auto built = build_scene(through(scene, "scene.obj", true));
  ASSERT_TRUE(built.ok()) << built.error().text;
  EXPECT_EQ((*built)->object_count(), scene.source.objects.size());
  EXPECT_FALSE((*built)->occluders().empty());
}

INSTANTIATE_TEST_SUITE_P(
    Generated, RoundTrip,
    testing::Values(Generator{"city", [] { return generate_city({.blocks = 2}); }},
                    Generator{"closed_city", [] { return generate_closed_city({.blocks = 2}); }},
                    Generator{"forest",
                              [] { return generate_forest({.trees = 40, .leaves = 30}); }},
                    Generator{"rooms", [] { return generate_rooms({.rooms = 3}); }},
                    Generator{"terrain", [] { return generate_terrain({.tiles = 2}); }},
                    Generator{"maze", [] { return generate_maze({.size = 6}); }}),
    [](const auto& generator_info) { return generator_info.param.name; });

}  // namespace
}  // namespace pvsfarm

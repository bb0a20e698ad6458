// Every real scene through the program itself: `pvsfarm bake`, then `pvsfarm validate`, as a user
// types them. That the sets are sound is real_scenes_test's to say; this says that the whole way
// from the files to a store holds at full size.
//
// PVSFARM_SCENES=FOLDER  where the real scenes are (default: ../shared/scenes beside the checkout);
//                        where none are, a generated one is baked instead
// PVSFARM_FULL=1         the large ones too: minutes each
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>

#include "common/cells/cell_source.hpp"
#include "common/pvs/store_reader.hpp"
#include "tests/golden/run_program.hpp"
#include "tests/scenes/real_scenes.hpp"

namespace pvsfarm {

void PrintTo(const NamedScene& scene, std::ostream* out) { *out << scene.name; }

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxCellsPlainRun = 1'100;

struct SceneFiles {
  std::string scene, tags, cells;
  std::string occluders = {};  // "": none
  std::string options = {};    // of the bake
};

std::string quoted(const std::string& path) { return "'" + path + "'"; }

// Sum over the cells of the occludees that each hides.
std::uint64_t hidden_in(StoreReader& store) {
  std::uint64_t occludees = 0, hidden = 0;
  const std::vector<StoreObject> objects = store.objects().value();
  for (const StoreObject& object : objects) occludees += object.occludee;
  for (std::uint32_t i = 0; i < store.node_count(); ++i)
    hidden += occludees - store.sets(i).value().visible.count();
  return hidden;
}

void bake_and_check(const SceneFiles& files, const TempFolder& folder) {
  const auto cells = read_cells(files.cells);
  ASSERT_TRUE(cells.ok()) << cells.error().text;
  if (cells->size() > kMaxCellsPlainRun && std::getenv("PVSFARM_FULL") == nullptr)
    GTEST_SKIP() << cells->size() << " cells: baked with PVSFARM_FULL=1 only";

  std::string arguments = "bake " + quoted(files.scene) + " --tags " + quoted(files.tags) +
                          " --cells " + quoted(files.cells) + " -o x.pvs" + files.options;
  if (!files.occluders.empty()) arguments += " --occluders " + quoted(files.occluders);
  const ProgramRun bake = run_pvsfarm(folder, arguments);
  ASSERT_EQ(bake.exit_code, 0) << bake.err;
  const ProgramRun validate = run_pvsfarm(folder, "validate x.pvs");
  EXPECT_EQ(validate.exit_code, 0) << validate.err;

  const auto store = StoreReader::open(folder.file("x.pvs"));
  ASSERT_TRUE(store.ok()) << store.error().text;
  EXPECT_EQ((*store)->root_count(), cells->size());
  EXPECT_EQ((*store)->leaf_count(), cells->size());  // no budget, no splits
  EXPECT_GT(hidden_in(**store), 0u) << "the bake culled nothing at all";
}

// All that a bake does by default but shafts, which take ten times as long in a town.
constexpr const char* kWithoutShafts =
    " --methods aimed-rays,projection,fine-projection,improved,sweep";

class Bake : public testing::TestWithParam<NamedScene> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(Bake);

TEST_P(Bake, gives_a_valid_store_of_every_cell) {
  const TempFolder folder;
  const fs::path from = fs::absolute(GetParam().folder);
  const fs::path occluders = from / "blockers.obj";
  bake_and_check({.scene = from / "scene.obj",
                  .tags = from / "tags.json",
                  .cells = from / "cells.json",
                  .occluders = fs::exists(occluders) ? occluders.string() : "",
                  .options = std::getenv("PVSFARM_FULL") == nullptr ? kWithoutShafts : ""},
                 folder);
}

TEST(BakeOfGeneratedRooms, gives_a_valid_store_of_every_cell_where_no_real_scene_is) {
  if (!scenes_on_disk().empty()) return;
  std::cout << "no real scenes here (PVSFARM_SCENES or ../shared/scenes): a generated one is baked "
               "instead\n";
  const TempFolder folder;
  const ProgramRun generate = run_pvsfarm(folder, "generate rooms -o rooms.obj");
  ASSERT_EQ(generate.exit_code, 0) << generate.err;
  bake_and_check({.scene = folder.file("rooms.obj"),
                  .tags = folder.file("rooms.tags.json"),
                  .cells = folder.file("rooms.cells.json")},
                 folder);
}

std::string name_of(const testing::TestParamInfo<NamedScene>& test) { return test.param.name; }
INSTANTIATE_TEST_SUITE_P(RealScenes, Bake, testing::ValuesIn(scenes_on_disk()), name_of);

}  // namespace
}  // namespace pvsfarm

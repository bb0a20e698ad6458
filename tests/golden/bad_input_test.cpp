// Bad input, each kind: `pvsfarm bake` says what is wrong in one line on stderr that names file and
// place, ends with the right exit code, and leaves nothing behind.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "tests/golden/run_program.hpp"

namespace pvsfarm {
namespace {

// Two objects: a file of one gets a warning, a line too many.
constexpr const char* kTwoThings =
    "o thing\nv 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 2 3\no other\nv 3 0 0\nv 4 0 0\nv 3 1 1\nf 4 5 6\n";
constexpr const char* kCell =
    R"({"units":"m","up":"z","cells":[{"id":7,"aabb":[[5,5,1],[6,6,2]]}]})";

std::string cells(const std::string& list) {
  return R"({"units":"m","up":"z","cells":[)" + list + "]}";
}

struct BadInput {
  std::string name;
  std::vector<std::pair<std::string, std::string>> files;  // besides s.obj and c.json
  std::string arguments = "bake s.obj --cells c.json -o out.pvs";
  int exit_code = 3;
  std::vector<std::string> says;  // each in the line on stderr
};

void PrintTo(const BadInput& input, std::ostream* out) { *out << input.name; }

std::vector<BadInput> scenes() {
  const std::string header = "o thing\nv 0 0 0\nv 1 0 0\n";
  return {
      {.name = "scene_missing",
       .files = {},
       .arguments = "bake no.obj --cells c.json -o out.pvs",
       .says = {"no.obj", "check the path"}},
      {.name = "scene_is_no_mesh",
       .files = {{"s.glb", "this is not a mesh"}},
       .arguments = "bake s.glb --cells c.json -o out.pvs",
       .says = {"s.glb"}},
      {.name = "scene_of_unknown_kind",
       .files = {{"s.txt", kTwoThings}},
       .arguments = "bake s.txt --cells c.json -o out.pvs",
       .exit_code = 5,
       .says = {"s.txt"}},
      {.name = "scene_file_empty", .files = {{"s.obj", ""}}, .says = {"s.obj"}},
      {.name = "scene_without_faces",
       .files = {{"s.obj", header + "v 0 1 1\n"}},
       .says = {"s.obj"}},
      {.name = "scene_vertex_nan",
       .files = {{"s.obj", header + "v 0 nan 1\nf 1 2 3\n"}},
       .says = {"s.obj"}},
      {.name = "scene_vertex_infinite",
       .files = {{"s.obj", header + "v 0 1e999 1\nf 1 2 3\n"}},
       .says = {"s.obj"}},
      {.name = "scene_face_past_the_vertices",
       .files = {{"s.obj", header + "v 0 1 1\nf 1 2 9\n"}},
       .says = {"s.obj"}},
      {.name = "scene_needs_an_unsupported_extension",
       .files = {{"s.gltf", R"({"asset":{"version":"2.0"},
          "extensionsRequired":["EXT_meshopt_compression"],
          "extensionsUsed":["EXT_meshopt_compression"],"scenes":[{"nodes":[]}]})"}},
       .arguments = "bake s.gltf --cells c.json -o out.pvs",
       .exit_code = 5,
       .says = {"s.gltf", "EXT_meshopt_compression"}},
      {.name = "tags_missing",
       .files = {},
       .arguments = "bake s.obj --tags no.json --cells c.json -o out.pvs",
       .says = {"no.json", "check the path"}},
      {.name = "tags_no_json",
       .files = {{"t.json", "{\"objects\":["}},
       .arguments = "bake s.obj --tags t.json --cells c.json -o out.pvs",
       .says = {"t.json"}},
      {.name = "tags_of_another_scene",
       .files = {{"t.json", R"({"objects":[{"name":"a"},{"name":"b"},{"name":"c"}]})"}},
       .arguments = "bake s.obj --tags t.json --cells c.json -o out.pvs",
       .says = {"t.json"}},
      {.name = "nothing_to_be_seen",
       .files = {{"t.json", R"({"objects":[{"name":"thing","occludee":false},
                                                {"name":"other","occludee":false}]})"}},
       .arguments = "bake s.obj --tags t.json --cells c.json -o out.pvs",
       .says = {"s.obj"}},
      {.name = "blockers_missing",
       .files = {},
       .arguments = "bake s.obj --occluders no.obj --cells c.json -o out.pvs",
       .says = {"no.obj", "check the path"}},
  };
}

std::vector<BadInput> cell_files() {
  const auto row = [](std::string name, const std::string& json,
                      std::vector<std::string> says) -> BadInput {
    says.push_back("c.json");
    return {.name = std::move(name), .files = {{"c.json", json}}, .says = std::move(says)};
  };
  return {
      {.name = "cells_missing",
       .files = {},
       .arguments = "bake s.obj --cells no.json -o out.pvs",
       .says = {"no.json", "check the path"}},
      row("cells_no_json", "cells: 1", {}),
      row("cells_cut_short", std::string(kCell).substr(0, 60), {}),
      row("cells_none", cells(""), {}),
      row("cells_of_zero_size", cells(R"({"id":7,"aabb":[[5,5,1],[5,5,1]]})"), {"7"}),
      row("cells_inside_out", cells(R"({"id":7,"aabb":[[5,5,1],[4,6,2]]})"), {"7"}),
      row("cells_with_one_id_twice",
          cells(R"({"id":7,"aabb":[[5,5,1],[6,6,2]]},{"id":7,"aabb":[[6,5,1],[7,6,2]]})"), {"7"}),
      row("cells_infinite", cells(R"({"id":7,"aabb":[[5,5,1],[1e999,6,2]]})"), {}),
      row("cells_with_text_for_a_number", cells(R"({"id":7,"aabb":[[5,5,"1"],[6,6,2]]})"), {"7"}),
      row("cells_with_skewed_axes",
          cells(R"({"id":8,"center":[5,5,1],"axes":[[1,0,0],[0.1,1,0],[0,0,1]],"half":[1,1,1]})"),
          {"8"}),
      row("cells_with_long_axes",
          cells(R"({"id":8,"center":[5,5,1],"axes":[[2,0,0],[0,2,0],[0,0,2]],"half":[1,1,1]})"),
          {"8"}),
      row("cells_with_a_negative_half",
          cells(R"({"id":8,"center":[5,5,1],"axes":[[1,0,0],[0,1,0],[0,0,1]],"half":[1,-1,1]})"),
          {"8"}),
      // A kilometre of ground in cells of a millimetre.
      {.name = "cells_by_the_billion",
       .files = {{"s.obj",
                  "o ground\nv 0 0 0\nv 1000 0 0\nv 1000 1000 0\nv 0 1000 0\nf 1 2 3 4\n"
                  "o thing\nv 1 1 0\nv 2 1 0\nv 1 2 1\nf 5 6 7\n"}},
       .arguments = "bake s.obj --cells grid:0.001 -o out.pvs",
       .says = {"0.001"}},
  };
}

std::vector<BadInput> command_lines() {
  return {
      {.name = "no_output_named",
       .files = {},
       .arguments = "bake s.obj --cells c.json",
       .exit_code = 1,
       .says = {"output"}},
      {.name = "no_scene_named",
       .files = {},
       .arguments = "bake --cells c.json -o out.pvs",
       .exit_code = 1,
       .says = {"scene"}},
      {.name = "unknown_option",
       .files = {},
       .arguments = "bake s.obj --cells c.json -o out.pvs --quick",
       .exit_code = 1,
       .says = {"--quick"}},
      {.name = "resolution_out_of_range",
       .files = {},
       .arguments = "bake s.obj --cells c.json -o out.pvs --resolution 100000",
       .exit_code = 1,
       .says = {"--resolution"}},
      {.name = "unknown_rasteriser",
       .files = {},
       .arguments = "bake s.obj --cells c.json -o out.pvs --raster quick",
       .exit_code = 1,
       .says = {"--raster"}},
      {.name = "grid_without_a_size",
       .files = {},
       .arguments = "bake s.obj --cells grid: -o out.pvs",
       .exit_code = 1,
       .says = {"grid"}},
      {.name = "grid_of_size_zero",
       .files = {},
       .arguments = "bake s.obj --cells grid:0 -o out.pvs",
       .exit_code = 1,
       .says = {"grid"}},
      {.name = "output_in_a_missing_folder",
       .files = {},
       .arguments = "bake s.obj --cells c.json -o no/out.pvs",
       .exit_code = 2,
       .says = {"no"}},
  };
}

class BadInputTest : public testing::TestWithParam<BadInput> {};

TEST_P(BadInputTest, is_told_in_one_line_and_leaves_nothing_behind) {
  const BadInput& input = GetParam();
  const TempFolder folder;
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream(folder.file(name), std::ios::binary) << text;
  };
  write("s.obj", kTwoThings);
  write("c.json", kCell);
  for (const auto& [name, text] : input.files) write(name, text);
  const std::size_t files_before = folder.file_count();

  const ProgramRun run = run_pvsfarm(folder, input.arguments);
  EXPECT_EQ(run.exit_code, input.exit_code) << run.err;
  EXPECT_EQ(run.out, "");
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  for (const std::string& text : input.says)
    EXPECT_NE(run.err.find(text), std::string::npos) << "no \"" << text << "\" in: " << run.err;
  EXPECT_EQ(folder.file_count(), files_before + 2);  // what the run itself caught: .stdout, .stderr
}

std::string name_of(const testing::TestParamInfo<BadInput>& test) { return test.param.name; }
INSTANTIATE_TEST_SUITE_P(Scenes, BadInputTest, testing::ValuesIn(scenes()), name_of);
INSTANTIATE_TEST_SUITE_P(Cells, BadInputTest, testing::ValuesIn(cell_files()), name_of);
INSTANTIATE_TEST_SUITE_P(CommandLines, BadInputTest, testing::ValuesIn(command_lines()), name_of);

}  // namespace
}  // namespace pvsfarm

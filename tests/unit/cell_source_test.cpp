#include "common/cells/cell_source.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace pvsfarm {
namespace {

namespace fs = std::filesystem;

class CellsFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "pvsfarm-cells-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    path_ = (folder_ / "cells.json").string();
  }
  void TearDown() override { fs::remove_all(folder_); }

  Result<std::vector<RootCell>> read(const std::string& text) {
    std::ofstream(path_, std::ios::trunc) << text;
    return read_cells(path_);
  }
  Result<std::vector<RootCell>> read_list(const std::string& cells) {
    return read(R"({"units":"m","up":"z","cells":[)" + cells + "]}");
  }
  // Refused as invalid input, in one line that names the file and holds all of `words`.
  void expect_refused(const Result<std::vector<RootCell>>& result,
                      std::initializer_list<const char*> words) {
    ASSERT_FALSE(result.ok());
    const Error& error = result.error();
    EXPECT_EQ(error.kind, ErrorKind::kInvalidInput);
    EXPECT_EQ(error.text.find('\n'), std::string::npos);
    EXPECT_EQ(error.text.rfind(path_ + ": ", 0), 0u) << error.text;
    for (const char* word : words)
      EXPECT_NE(error.text.find(word), std::string::npos) << error.text << "\nlacks: " << word;
  }

  fs::path folder_;
  std::string path_;
};

TEST_F(CellsFile, gives_aligned_cells_their_very_coordinates_in_file_order) {
  const auto cells = read_list(R"({"id":7,"aabb":[[0.1,1e7,-3],[0.3,10000000.2,-2]]},
                                  {"id":-4,"aabb":[[0,0,0],[1,0,0]]})");
  ASSERT_TRUE(cells.ok()) << cells.error().text;
  ASSERT_EQ(cells->size(), 2u);
  EXPECT_EQ((*cells)[0].id, 7);
  EXPECT_EQ((*cells)[0].cell, Cell::aligned({{0.1, 1e7, -3}, {0.3, 10000000.2, -2}}));
  EXPECT_EQ((*cells)[1].id, -4);  // flat along two axes, but not a point
}

TEST_F(CellsFile, gives_oriented_cells) {
  const auto cells = read_list(
      R"({"id":1,"center":[10,20,1.7],"axes":[[0.6,0.8,0],[-0.8,0.6,0],[0,0,1]],
          "half":[3,2,0.2]})");
  ASSERT_TRUE(cells.ok()) << cells.error().text;
  const Cell& cell = (*cells)[0].cell;
  EXPECT_EQ(cell.center(), Vec3(10, 20, 1.7));
  EXPECT_EQ(cell.half(), Vec3(3, 2, 0.2));
  EXPECT_EQ(cell.axes[1], Vec3(-0.8, 0.6, 0));
}

TEST_F(CellsFile, turns_y_up_cells_exactly_wherever_up_stands_in_the_file) {
  const auto cells = read(
      R"({"cells":[{"id":1,"aabb":[[1,1.5,10],[2,1.9,13]]},
                   {"id":2,"center":[5,1.7,-6],"axes":[[1,0,0],[0,1,0],[0,0,1]],"half":[1,2,3]}],
          "up":"y"})");
  ASSERT_TRUE(cells.ok()) << cells.error().text;
  EXPECT_EQ((*cells)[0].cell, Cell::aligned({{1, -13, 1.5}, {2, -10, 1.9}}));
  const Cell& turned = (*cells)[1].cell;
  EXPECT_EQ(turned.center(), Vec3(5, 6, 1.7));
  const Box box = turned.bounds();
  EXPECT_NEAR(box.size().y, 6, 1e-9);  // the file's z
  EXPECT_NEAR(box.size().z, 4, 1e-9);
}

TEST_F(CellsFile, takes_other_units_and_unknown_keys_as_they_are) {
  const auto cells = read(
      R"({"units":"inch","note":[{"id":1}],
          "cells":[{"id":1,"name":"a","aabb":[[0,0,0],[1,1,1]]}]})");
  ASSERT_TRUE(cells.ok()) << cells.error().text;
  EXPECT_EQ(cells->size(), 1u);
}

TEST_F(CellsFile, that_is_missing_is_bad_input) {
  const auto cells = read_cells(path_);
  ASSERT_FALSE(cells.ok());
  EXPECT_EQ(cells.error().kind, ErrorKind::kInvalidInput);
  EXPECT_NE(cells.error().text.find(path_), std::string::npos);
}

TEST_F(CellsFile, that_is_not_json_is_refused_with_the_place) {
  expect_refused(read("{\"cells\":[\n {\"id\":7,"), {"not JSON", "line 2"});
  expect_refused(read(""), {"not JSON"});
  expect_refused(read_list(R"({"id":7,"aabb":[[NaN,0,0],[1,1,1]]})"), {"not JSON", "last read"});
  expect_refused(read_list(R"({"id":7,"aabb":[[1e999,0,0],[1,1,1]]})"), {"not JSON", "1e999"});
}

TEST_F(CellsFile, without_cells_is_refused) {
  expect_refused(read("[]"), {"\"cells\""});
  expect_refused(read(R"({"up":"z"})"), {"\"cells\""});
  expect_refused(read(R"({"cells":{"id":1,"aabb":[[0,0,0],[1,1,1]]}})"), {"\"cells\""});
  expect_refused(read_list(""), {"no cells"});
  expect_refused(read_list("[1,2]"), {"not an object"});
  expect_refused(read_list(R"({"id":1,"aabb":[[0,0,0],[1,1,1]]},5)"), {"not an object"});
}

TEST_F(CellsFile, with_another_up_axis_is_refused) {
  expect_refused(read(R"({"up":"x","cells":[{"id":1,"aabb":[[0,0,0],[1,1,1]]}]})"),
                 {"\"up\"", "\"x\""});
}

TEST_F(CellsFile, with_a_point_for_a_cell_is_refused) {
  expect_refused(
      read_list(R"({"id":3,"aabb":[[0,0,0],[1,1,1]]},{"id":9,"aabb":[[1,2,3],[1,2,3]]})"),
      {"cell 1 (id 9)", "no extent"});
  expect_refused(
      read_list(R"({"id":9,"center":[0,0,0],"axes":[[1,0,0],[0,1,0],[0,0,1]],"half":[0,0,0]})"),
      {"cell 0 (id 9)", "no extent"});
}

TEST_F(CellsFile, with_a_box_upside_down_is_refused) {
  expect_refused(read_list(R"({"id":9,"aabb":[[0,5,0],[1,2,1]]})"), {"(id 9)", "along y"});
}

TEST_F(CellsFile, with_an_id_twice_is_refused_with_both_places) {
  expect_refused(read_list(R"({"id":4,"aabb":[[0,0,0],[1,1,1]]},{"id":5,"aabb":[[0,0,0],[1,1,1]]},
                              {"id":4,"aabb":[[1,0,0],[2,1,1]]})"),
                 {"cell 2 (id 4)", "cell 0"});
}

TEST_F(CellsFile, without_a_usable_id_is_refused) {
  expect_refused(read_list(R"({"aabb":[[0,0,0],[1,1,1]]})"), {"cell 0", "no \"id\""});
  expect_refused(read_list(R"({"id":1.5,"aabb":[[0,0,0],[1,1,1]]})"), {"cell 0", "1.5"});
  expect_refused(read_list(R"({"id":"a","aabb":[[0,0,0],[1,1,1]]})"), {"cell 0", "\"a\""});
  expect_refused(read_list(R"({"id":18446744073709551615,"aabb":[[0,0,0],[1,1,1]]})"), {"64 bits"});
}

TEST_F(CellsFile, with_coordinates_that_are_no_points_is_refused) {
  expect_refused(read_list(R"({"id":1,"aabb":[[0,0],[1,1,1]]})"), {"(id 1)", "aabb"});
  expect_refused(read_list(R"({"id":1,"aabb":[[0,0,0]]})"), {"(id 1)", "two points"});
  expect_refused(read_list(R"({"id":1,"aabb":[[0,0,null],[1,1,1]]})"), {"(id 1)", "aabb"});
  expect_refused(read_list(R"({"id":1,"aabb":[[0,0,0],[1e300,1,1]]})"), {"(id 1)", "1e12"});
  expect_refused(read_list(R"({"id":1})"), {"(id 1)", "neither"});
  expect_refused(read_list(R"({"id":1,"aabb":[[0,0,0],[1,1,1]],"center":[0,0,0]})"),
                 {"(id 1)", "both"});
  expect_refused(read_list(R"({"id":1,"center":[0,0,0],"half":[1,1,1]})"), {"(id 1)", "axes"});
  expect_refused(read_list(R"({"id":1,"center":[0,0,0],"axes":[[1,0,0],[0,1,0],[0,0,1]]})"),
                 {"(id 1)", "half"});
  expect_refused(
      read_list(R"({"id":1,"center":[0,0,0],"axes":[[1,0,0],[0,1,0],[0,0,1]],"half":[1,-1,1]})"),
      {"(id 1)", "negative"});
}

TEST_F(CellsFile, with_axes_not_orthonormal_is_refused) {
  expect_refused(
      read_list(R"({"id":8,"center":[0,0,0],"axes":[[1,0,0],[0,2,0],[0,0,1]],"half":[1,1,1]})"),
      {"(id 8)", "orthonormal", "row 1"});
  expect_refused(
      read_list(R"({"id":8,"center":[0,0,0],"axes":[[1,0,0],[0,1,0],[0,0.6,0.8]],"half":[1,1,1]})"),
      {"(id 8)", "orthonormal", "rows 1 and 2"});
}

TEST(Grid, size_and_height_are_parsed) {
  EXPECT_EQ(parse_grid("grid:5")->size, 5);
  EXPECT_EQ(parse_grid("grid:5")->height, GridRequest{}.height);
  EXPECT_EQ(parse_grid("grid:2.5:1")->size, 2.5);
  EXPECT_EQ(parse_grid("grid:2.5:1")->height, 1);
}

TEST(Grid, of_another_form_is_refused_with_the_form) {
  for (const char* text : {"grid", "grid:", "grid:0", "grid:-1", "grid:x", "grid:5:", "grid:5:0",
                           "grid:5:1:2", "grid:nan", "grid:inf", "grid:5m", " grid:5"}) {
    const auto grid = parse_grid(text);
    ASSERT_FALSE(grid.ok()) << text;
    EXPECT_EQ(grid.error().kind, ErrorKind::kCommandLine);
    EXPECT_NE(grid.error().text.find(text), std::string::npos);
    EXPECT_NE(grid.error().text.find("grid:SIZE"), std::string::npos);
  }
}

}  // namespace
}  // namespace pvsfarm

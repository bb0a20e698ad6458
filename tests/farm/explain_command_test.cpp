// `pvsfarm explain` on a small city whose file is y up: what it says must fit what `export` says.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/farm/process.hpp"

namespace pvsfarm {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string kPvsfarm = PVSFARM_BIN_DIR "/pvsfarm";

class ExplainCommand : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    std::string pattern = testing::TempDir() + "explain-XXXXXX";
    folder_ = mkdtemp(pattern.data());
    run({"generate", "city", "--blocks", "2", "-o", folder_ + "/city.glb"}, 0);
    run({"generate", "city", "--blocks", "2", "--seed", "2", "-o", folder_ + "/other.glb"}, 0);
    Json cells = Json::parse(std::ifstream(folder_ + "/city.cells.json"));
    auto& list = cells.at("cells");
    list = Json::array({list.at(40), list.at(list.size() / 2)});
    std::ofstream(folder_ + "/cells.json") << cells;
    run({"bake", folder_ + "/city.glb", "--cells", folder_ + "/cells.json", "--tags",
         folder_ + "/city.tags.json", "--workers", "1", "-o", folder_ + "/city.pvs"},
        0);
    std::istringstream lines(run({"export", folder_ + "/city.pvs"}, 0));
    std::string line;
    while (std::getline(lines, line)) exported_.push_back(Json::parse(line));
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  // What it prints, on stdout, or on stderr if it is to fail.
  static std::string run(std::vector<std::string> words, int code) {
    words.insert(words.begin(), kPvsfarm);
    Process process(words, folder_ + "/log");
    EXPECT_EQ(process.wait(), code) << process.err();
    return code == 0 ? process.out() : process.err();
  }
  static std::string explain(const std::vector<std::string>& words, int code = 0,
                             const std::string& scene = "/city.glb") {
    std::vector<std::string> all{"explain", folder_ + "/city.pvs", folder_ + scene, "--tags",
                                 folder_ + "/city.tags.json"};
    all.insert(all.end(), words.begin(), words.end());
    return run(all, code);
  }

  static const Json& object(std::size_t id) { return exported_.at(0).at("objects").at(id); }
  static const Json& cell() { return exported_.at(1); }  // number 0
  static bool lists(const char* set, std::size_t id) {
    const Json& ids = cell().at(set);
    return std::find(ids.begin(), ids.end(), Json(id)) != ids.end();
  }
  // The first building that is in both sets, or in neither.
  static std::string building(bool visible, bool seen) {
    for (std::size_t id = 0; id < exported_.at(0).at("objects").size(); ++id) {
      const std::string name = object(id).at("name");
      if (name.rfind("building", 0) == 0 && lists("visible", id) == visible &&
          lists("seen", id) == seen)
        return name;
    }
    ADD_FAILURE() << "no such building";
    return "";
  }
  static Json answer(const std::string& name) {
    return Json::parse(explain({"--cell", "0", "--object", name, "--json"}));
  }
  static void expect_inside(const Json& point, const Json& lo, const Json& hi) {
    for (int a = 0; a < 3; ++a) {
      EXPECT_GE(point.at(a).get<double>(), lo.at(a).get<double>() - 1e-9);
      EXPECT_LE(point.at(a).get<double>(), hi.at(a).get<double>() + 1e-9);
    }
  }

  static std::string folder_;
  static std::vector<Json> exported_;
};
std::string ExplainCommand::folder_;
std::vector<Json> ExplainCommand::exported_;

TEST_F(ExplainCommand, a_hidden_building_has_blockers_that_cover_it_all) {
  const std::string name = building(false, false);
  const Json found = answer(name);
  EXPECT_EQ(found.at("visible"), false);
  EXPECT_EQ(found.at("agrees"), true);
  for (const Json& piece : found.at("pieces")) {
    EXPECT_EQ(piece.at("verdict"), "hidden");
    EXPECT_GE(piece.at("lines_checked"), 512);
    EXPECT_TRUE(piece.at("unblocked").empty());
    ASSERT_FALSE(piece.at("parts").empty());
    for (const Json& part : piece.at("parts")) {
      EXPECT_EQ(part.at("covered"), 1);
      EXPECT_FALSE(part.at("blockers").empty());
    }
    // What was tried, as the bake's statistics tell it, too, but for the time it took there.
    ASSERT_FALSE(piece.at("rounds").empty());
    EXPECT_GT(piece.at("rounds").at(0).at("open").at(0), 0);
  }
  const std::string picture = folder_ + "/why.png";
  const std::string text = explain({"--cell", "0", "--object", name, "--picture", picture});
  EXPECT_EQ(text.rfind(name + " is hidden from cell 0.\n", 0), 0u) << text;
  EXPECT_NE(text.find("opaque triangles block them all."), std::string::npos);
  EXPECT_NE(text.find("\nThe cell was tried with, in turn:\n"), std::string::npos) << text;
  EXPECT_GT(fs::file_size(picture), 5000u);
}

TEST_F(ExplainCommand, a_seen_building_has_a_line_in_the_files_coordinates) {
  const std::string name = building(true, true);
  const Json found = answer(name);
  EXPECT_EQ(found.at("visible"), true);
  const Json& line = found.at("pieces").at(0).at("line");
  Json lo = cell().at("center"), hi = lo;
  for (int a = 0; a < 3; ++a) {
    lo[a] = lo[a].get<double>() - cell().at("half").at(a).get<double>();
    hi[a] = hi[a].get<double>() + cell().at("half").at(a).get<double>();
  }
  expect_inside(line.at("eye"), lo, hi);
  const Json& box = object(found.at("object").at("id")).at("aabb");
  expect_inside(line.at("point"), box.at(0), box.at(1));
  // The same cell by a point of it, the same object by its number.
  const Json& c = cell().at("center");
  const std::string at = c.at(0).dump() + ',' + c.at(1).dump() + ',' + c.at(2).dump();
  const std::string number = '#' + found.at("object").at("id").dump();
  EXPECT_EQ(Json::parse(explain({"--at", at, "--object", number, "--json"})), found);
}

TEST_F(ExplainCommand, what_cannot_be_asked_is_said_in_one_line) {
  EXPECT_NE(explain({"--cell", "0", "--object", "buildin_0_0_0"}, 3)
                .find("no object is called buildin_0_0_0; did you mean building_0_0_0"),
            std::string::npos);
  EXPECT_NE(explain({"--cell", "99", "--object", "building_0_0_0"}, 1).find("has 2 cells"),
            std::string::npos);
  EXPECT_NE(explain({"--at", "0,500,0", "--object", "building_0_0_0"}, 3).find("no cell holds"),
            std::string::npos);
  EXPECT_NE(explain({"--cell", "0", "--object", "building_0_0_0"}, 3, "/other.glb")
                .find("not the scene of"),
            std::string::npos);
  explain({"--object", "building_0_0_0"}, 1);
}

}  // namespace
}  // namespace pvsfarm

// `pvsfarm chart` as a user runs it: two cells of a small scene on real workers, the files it
// writes, and what it says when something is wrong. Nothing here draws.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/golden/run_program.hpp"

namespace pvsfarm {
namespace {

using nlohmann::json;

std::vector<json> lines_of(const std::string& text) {
  std::vector<json> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    if (end > at) lines.push_back(json::parse(text.substr(at, end - at)));
    at = end + 1;
  }
  return lines;
}

class ChartCommand : public testing::Test {
 protected:
  ProgramRun run(const std::string& arguments) { return run_pvsfarm(folder_, arguments); }
  std::vector<json> measure(const std::string& data, const std::string& more) {
    const ProgramRun made = run("generate maze --size 3 -o maze.obj");
    EXPECT_EQ(made.exit_code, 0) << made.err;
    const ProgramRun ran =
        run("chart maze.obj -q --cells maze.cells.json --tags maze.tags.json --sample 2 "
            "--series bake,sampling --sampling-rays 10000 --json " +
            data + " " + more);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_EQ(ran.err, "");
    table_ = ran.out;
    return ran.exit_code == 0 ? lines_of(*read_file(folder_.file(data))) : std::vector<json>{};
  }

  TempFolder folder_;
  std::string table_;
};

TEST_F(ChartCommand, MeasuresTwoSeriesOnTwoCells) {
  const auto rows = measure("data.jsonl", "-o chart.vl.json");
  ASSERT_EQ(rows.size(), 2u);
  const json &bake = rows[0], &sampling = rows[1];
  EXPECT_EQ(bake["scene"], "maze");
  EXPECT_EQ(bake["series"], "bake");
  EXPECT_EQ(bake["cells"], 2);
  EXPECT_EQ(bake["violations"], 0);
  EXPECT_GT(bake["cpu_ms"], 0);
  EXPECT_GE(bake["pvs_over_seen_triangles"], 1) << "a PVS lacks something that was seen";
  EXPECT_GT(bake["found_objects"], 0.5) << "the bake's witnesses see too";
  EXPECT_GE(bake["gap"], 0);
  EXPECT_EQ(sampling["methods"], "look-around");
  EXPECT_EQ(sampling["max_rays"], 10'000);
  EXPECT_EQ(sampling["proves"], false);
  EXPECT_TRUE(sampling["gap"].is_null());
  EXPECT_LE(sampling["found_objects"], 1);
  EXPECT_NE(table_.find("random rays (prove nothing) | 1e4 rays | 2 of"), std::string::npos)
      << table_;

  const json spec = json::parse(*read_file(folder_.file("chart.vl.json")));
  EXPECT_EQ(spec["data"]["values"].size(), 2u);

  // Shown again from the file: the same table, the same chart, without the scene.
  const ProgramRun again = run("chart --data data.jsonl -o again.vl.json");
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(again.out, table_);
  EXPECT_EQ(*read_file(folder_.file("again.vl.json")), *read_file(folder_.file("chart.vl.json")));
}

TEST_F(ChartCommand, FiguresButTheTimesDoNotDependOnTheWorkers) {
  auto one = measure("one.jsonl", "--workers 1 --runs 1");
  auto two = measure("two.jsonl", "--workers 2 --runs 2");
  ASSERT_EQ(one.size(), 2u);
  for (auto* rows : {&one, &two})
    for (json& row : *rows)
      for (const char* time : {"cpu_ms", "cpu_ms_median", "cpu_ms_most"}) row.erase(time);
  EXPECT_EQ(one, two);
}

TEST_F(ChartCommand, SomethingSeenAmongTheHiddenEndsWithSeven) {
  auto rows = measure("data.jsonl", "");
  ASSERT_EQ(rows.size(), 2u);
  rows[0]["violations"] = 2;
  ASSERT_TRUE(write_file(folder_.file("bad.jsonl"), rows[0].dump() + "\n").ok());
  const ProgramRun ran = run("chart --data bad.jsonl");
  EXPECT_EQ(ran.exit_code, 7);
  EXPECT_NE(ran.err.find("2 objects were declared hidden"), std::string::npos) << ran.err;
}

TEST_F(ChartCommand, WhatIsWrongIsSaidInOneLine) {
  struct Wrong {
    std::string arguments;
    int exit_code;
    std::string says;
  };
  ASSERT_TRUE(write_file(folder_.file("broken.jsonl"), "{\"scene\":\n").ok());
  ASSERT_TRUE(write_file(folder_.file("empty.jsonl"), "").ok());
  for (const Wrong& wrong : std::vector<Wrong>{
           {"chart", 1, "--data"},
           {"chart s.obj --series guesses", 1, "guesses"},
           {"chart s.obj --kind pie", 1, "pie"},
           {"chart no.obj", 3, "no.obj"},
           {"chart --data no.jsonl", 2, "no.jsonl"},
           {"chart --data broken.jsonl", 3, "broken.jsonl:1"},
           {"chart --data empty.jsonl", 3, "no row"},
       }) {
    const ProgramRun ran = run(wrong.arguments);
    EXPECT_EQ(ran.exit_code, wrong.exit_code) << wrong.arguments << ": " << ran.err;
    EXPECT_NE(ran.err.find(wrong.says), std::string::npos) << wrong.arguments << ": " << ran.err;
    EXPECT_EQ(std::count(ran.err.begin(), ran.err.end(), '\n'), 1) << ran.err;
    EXPECT_EQ(ran.out, "") << wrong.arguments;
  }
}

TEST_F(ChartCommand, WithoutTheProgramThatDrawsTheSpecificationIsStillThere) {
  ASSERT_EQ(measure("data.jsonl", "").size(), 2u);
  const ProgramRun ran =
      run("chart --data data.jsonl -o chart.vl.json --svg chart.svg --vl2svg ./no-vl2svg");
  EXPECT_EQ(ran.exit_code, 5);
  EXPECT_NE(ran.err.find("--charts"), std::string::npos) << ran.err;
  EXPECT_TRUE(std::filesystem::exists(folder_.file("chart.vl.json")));
  EXPECT_FALSE(std::filesystem::exists(folder_.file("chart.svg")));
}

}  // namespace
}  // namespace pvsfarm

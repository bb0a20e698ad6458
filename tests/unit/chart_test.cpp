// What charts and tables are made of: data files, fits, specifications, drawing.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "common/base/file.hpp"
#include "coordinator/chart/draw.hpp"
#include "coordinator/chart/fit.hpp"
#include "coordinator/chart/gain.hpp"
#include "coordinator/chart/table.hpp"
#include "tests/unit/chart_samples.hpp"
#include "tests/unit/store_samples.hpp"

namespace pvsfarm {
namespace {

using nlohmann::json;

TEST(ChartRows, ComeBackAsTheyWereWritten) {
  ChartRow row = sample_row("a \"city\"\n", "cascade", 0.1);
  row.max_rays = 1ull << 60;
  row.violations = 3;
  const ChartRow without_gap = sample_row("b", "sampling", 1e4);
  const std::string lines = to_json(row) + "\n\n" + to_json(without_gap);
  const auto back = parse_chart_rows(lines, "data.jsonl");
  ASSERT_TRUE(back.ok()) << back.error().text;
  ASSERT_EQ(back->size(), 2u);
  EXPECT_EQ(to_json((*back)[0]), to_json(row));
  EXPECT_EQ((*back)[0].scene, row.scene);
  EXPECT_EQ((*back)[0].max_rays, row.max_rays);
  EXPECT_EQ((*back)[0].gap, row.gap);
  EXPECT_FALSE((*back)[1].gap.has_value());
}

TEST(ChartRows, ABrokenLineIsNamed) {
  const std::string good = to_json(sample_row("a", "cascade", 0.1)) + "\n";
  for (const char* bad : {"{\"scene\":", "[]", "{\"scene\":\"a\"}", "{\"scene\":1}"}) {
    const auto rows = parse_chart_rows(good + bad, "data.jsonl");
    ASSERT_FALSE(rows.ok()) << bad;
    EXPECT_EQ(rows.error().kind, ErrorKind::kInvalidInput);
    EXPECT_NE(rows.error().text.find("data.jsonl:2"), std::string::npos) << rows.error().text;
  }
}

TEST(ChartFit, FindsThePowerLawThatPointsFollow) {
  std::vector<ChartPoint> points;
  for (const double x : {10.0, 100.0, 450.0, 9000.0}) points.push_back({x, 3 * std::pow(x, 0.7)});
  points.push_back({0, 5});  // no logarithm: left out
  const auto law = fit_power_law(points);
  ASSERT_TRUE(law.has_value());
  EXPECT_NEAR(law->exponent, 0.7, 1e-12);
  EXPECT_NEAR(law->factor, 3, 1e-10);
  EXPECT_NEAR(law->at(450), points[2].y, 1e-9);
}

TEST(ChartFit, HalvesTheErrorsBetweenScatteredPoints) {
  // One point above and one below at each end: the law goes through the middle (in logarithms).
  const std::vector<ChartPoint> points{{1, 2}, {1, 0.5}, {100, 20}, {100, 5}};
  const auto law = fit_power_law(points);
  ASSERT_TRUE(law.has_value());
  EXPECT_NEAR(law->exponent, 0.5, 1e-12);
  EXPECT_NEAR(law->factor, 1, 1e-12);
}

TEST(ChartFit, OneSizeTellsNoExponent) {
  EXPECT_FALSE(fit_power_law({}).has_value());
  const std::vector<ChartPoint> points{{7, 1}, {7, 2}, {7, 3}};
  EXPECT_FALSE(fit_power_law(points).has_value());
}

TEST(ChartFit, InterpolatesAlongTheLogarithmOfTime) {
  const std::vector<ChartPoint> points{{1, 0.5}, {100, 0.9}, {1000, 1}};
  EXPECT_DOUBLE_EQ(*where_reached(points, 0.7), 10);
  EXPECT_DOUBLE_EQ(*where_reached(points, 0.9), 100);
  EXPECT_DOUBLE_EQ(*where_reached(points, 0.4), 1);
  EXPECT_DOUBLE_EQ(*where_reached(points, 1), 1000);
  EXPECT_FALSE(where_reached(std::span(points).first(2), 0.95).has_value());
}

std::vector<ChartRow> rival_rows(double found_last) {
  std::vector<ChartRow> rows{sample_row("city", "bake", 0.15)};
  rows[0].cpu_ms = 10;
  for (const auto& [ms, found] : {std::pair{10.0, 0.6}, {100.0, 0.99}, {1000.0, found_last}}) {
    rows.push_back(sample_row("city", "sampling", ms));
    rows.back().cpu_ms = ms;
    rows.back().found_objects = found;
  }
  return rows;
}

TEST(ChartRival, TheRatioIsOfTheTimesToTheSameShare) {
  const auto rows = rival_rows(1.0);
  const auto found = compare_with_sampling(rows);
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->rival_ms.value(), 100 * std::sqrt(10), 1e-6);  // half way from 0.99 to 1
  EXPECT_NEAR(found->ratio, 10 * std::sqrt(10), 1e-6);
  const auto table = chart_table(ChartKind::kRival, rows);
  ASSERT_TRUE(table.ok());
  EXPECT_NE(table->find("31.6 times as long"), std::string::npos) << *table;
}

TEST(ChartRival, WhatIsNeverReachedGivesOnlyABound) {
  const auto rows = rival_rows(0.992);
  const auto found = compare_with_sampling(rows);
  ASSERT_TRUE(found.has_value());
  EXPECT_FALSE(found->rival_ms.has_value());
  EXPECT_DOUBLE_EQ(found->ratio, 100);
  const auto table = chart_table(ChartKind::kRival, rows);
  ASSERT_TRUE(table.ok());
  EXPECT_NE(table->find("more than 100.0 times as long"), std::string::npos) << *table;
  EXPECT_FALSE(compare_with_sampling(std::span(rows).first(1)).has_value());
}

// Collects the fields that encodings, facets and transforms name.
void fields_of(const json& node, std::set<std::string>& used, std::set<std::string>& made) {
  if (node.is_object()) {
    for (const auto& [key, value] : node.items()) {
      if (key == "values") continue;  // the data
      if (key == "field" && value.is_string()) used.insert(value);
      if (key == "as" && value.is_string()) made.insert(value);
      if (key == "groupby")
        for (const json& field : value) used.insert(field);
      fields_of(value, used, made);
    }
  } else if (node.is_array()) {
    for (const json& item : node) fields_of(item, used, made);
  }
}

void expect_whole(const std::string& text) {
  const json spec = json::parse(text, nullptr, false);
  ASSERT_FALSE(spec.is_discarded()) << text;
  EXPECT_NE(spec.at("$schema").get<std::string>().find("vega-lite"), std::string::npos);
  std::set<std::string> there, used, made;
  for (const json& value : spec.at("data").at("values"))
    for (const auto& [key, field] : value.items()) there.insert(key);
  ASSERT_FALSE(there.empty());
  fields_of(spec, used, made);
  ASSERT_GE(used.size(), 3u);
  for (const std::string& field : used)
    EXPECT_TRUE(there.contains(field) || made.contains(field)) << field << " is in no data";
}

std::vector<ChartRow> some_of_each() {
  std::vector<ChartRow> rows;
  for (const char* scene : {"one", "two"}) {
    for (const Series& series : all_series())
      for (const SeriesPoint& point : series.points({})) {
        rows.push_back(sample_row(scene, series.name, point.value));
        rows.back().label = point.label;
      }
    for (ChartRow& row : rows)
      if (row.scene == "two") row.scene_triangles = 5000;
  }
  return rows;
}

TEST(ChartSpec, NamesNoFieldThatItsDataLack) {
  const auto rows = some_of_each();
  for (const ChartKind kind : {ChartKind::kAccuracy, ChartKind::kResolution, ChartKind::kScale,
                               ChartKind::kRival, ChartKind::kIngredients}) {
    const auto spec = chart_spec(kind, rows);
    ASSERT_TRUE(spec.ok()) << to_string(kind);
    expect_whole(*spec);
    EXPECT_EQ(chart_kind_named(to_string(kind)), kind);
  }
}

TEST(ChartSpec, ShowsEverySeriesInItsColor) {
  const auto spec = json::parse(*chart_spec(ChartKind::kAccuracy, some_of_each()));
  const json& scale = spec["vconcat"][0]["spec"]["layer"][1]["encoding"]["color"]["scale"];
  const auto shown = series_shown(ChartKind::kAccuracy);
  EXPECT_EQ(shown.size() + 1, all_series().size()) << "all but the ingredients are curves";
  ASSERT_EQ(scale["domain"].size(), shown.size());
  ASSERT_EQ(scale["range"].size(), shown.size());
  EXPECT_EQ(scale["domain"][0], all_series()[0].legend);
  std::size_t points = 0;
  for (const std::string& name : shown) points += series_named(name)->points({}).size();
  EXPECT_EQ(spec["data"]["values"].size(), 2 * points);
}

TEST(ChartSpec, AChartOfNothingIsAnError) {
  const std::vector<ChartRow> rows{sample_row("city", "extent", 1)};
  EXPECT_EQ(chart_spec(ChartKind::kResolution, rows).error().kind, ErrorKind::kInvalidInput);
  EXPECT_EQ(chart_table(ChartKind::kScale, {}).error().kind, ErrorKind::kInvalidInput);
  EXPECT_EQ(stability_spec({}).error().kind, ErrorKind::kInvalidInput);
}

TEST(ChartTable, TellsTheExponentOfTimeOverSize) {
  std::vector<ChartRow> rows;
  for (const double size : {1.0, 4.0, 16.0}) {
    rows.push_back(sample_row("city", "bake", 0));
    rows.back().scene_triangles = static_cast<std::uint64_t>(1000 * size);
    rows.back().cpu_ms = std::sqrt(size);
  }
  const auto table = chart_table(ChartKind::kScale, rows);
  ASSERT_TRUE(table.ok());
  EXPECT_NE(table->find("a bake's settings: 0.50."), std::string::npos) << *table;
}

TEST(ChartIngredients, AreTheBakesMethodsWithOneMoreOrLess) {
  SeriesBase base;
  base.settings.methods = {Method::kAimedRays, Method::kProjection};
  const auto points = series_named("ingredients")->points(base);
  ASSERT_EQ(points.size(), 1u + kMethodCount);
  EXPECT_EQ(points[0].settings.methods, base.settings.methods);
  std::set<std::uint32_t> different;
  for (const SeriesPoint& point : points) {
    EXPECT_EQ(point.settings.gap, 0) << "a method would not have its turn";
    different.insert(point.settings.methods.bits());
    const auto changed = base.settings.methods.bits() ^ point.settings.methods.bits();
    EXPECT_TRUE((changed & (changed - 1)) == 0) << point.label;
  }
  EXPECT_EQ(different.size(), points.size());
}

TEST(ChartTable, SetsIngredientsAgainstTheBakeOfTheirOwnScene) {
  std::vector<ChartRow> rows;
  for (const char* scene : {"one", "two"})
    for (const double value : {0.0, 1.0}) {
      rows.push_back(sample_row(scene, "ingredients", value));
      rows.back().label = value == 0 ? kAllIngredients : "without projection";
      rows.back().pvs_triangles = (scene == std::string("one") ? 100 : 1000) + 50 * value;
    }
  const auto table = chart_table(ChartKind::kIngredients, rows);
  ASSERT_TRUE(table.ok());
  EXPECT_NE(table->find("| one | without projection | 2.50 | +100.0 | 150 | +50.0 |"),
            std::string::npos)
      << *table;
  EXPECT_NE(table->find("| two | without projection | 2.50 | +100.0 | 1050 | +5.0 |"),
            std::string::npos)
      << *table;
}

ChartRow improved_row(const char* scene, const char* label, double triangles) {
  ChartRow row = sample_row(scene, "improved", 0);
  row.label = label;
  row.pvs_triangles = triangles;
  return row;
}

// A bake of 100 triangles in 10 ms; without one method it is 125 in 8 ms, with another 75 in 30 ms.
std::vector<ChartRow> rows_of_ingredients() {
  std::vector<ChartRow> rows;
  for (const auto& [label, triangles, ms] : {std::tuple{kAllIngredients, 100.0, 10.0},
                                             {"without improved", 125.0, 8.0},
                                             {"with surfaces", 75.0, 30.0}}) {
    rows.push_back(sample_row("city", "ingredients", 0));
    rows.back().label = label;
    rows.back().pvs_triangles = triangles;
    rows.back().cpu_ms = ms;
  }
  return rows;
}

TEST(ChartIngredients, AGainIsWithTheMethodAgainstWithoutIt) {
  const auto gains = method_gains(rows_of_ingredients());
  ASSERT_EQ(gains.size(), 2u);
  EXPECT_EQ(gains[0].method, "improved");
  EXPECT_TRUE(gains[0].in_bake);
  EXPECT_NEAR(gains[0].smaller_percent, 20, 1e-9);  // of 125, not of the bake's 100
  EXPECT_NEAR(gains[0].longer_percent, 25, 1e-9);
  EXPECT_EQ(gains[1].method, "surfaces");
  EXPECT_FALSE(gains[1].in_bake);
  EXPECT_NEAR(gains[1].smaller_percent, 25, 1e-9);
  EXPECT_NEAR(gains[1].longer_percent, 200, 1e-9);
}

TEST(ChartIngredients, ASceneWithoutItsBakeHasNoGains) {
  auto rows = rows_of_ingredients();
  rows[0].scene = "another";
  EXPECT_TRUE(method_gains(rows).empty());
  EXPECT_EQ(ingredients_spec(rows).error().kind, ErrorKind::kInvalidInput);
}

TEST(ChartIngredients, TheImprovedProjectionStandsBesideThePapers) {
  auto rows = rows_of_ingredients();
  rows.push_back(improved_row("city", kPlainProjections, 200));
  rows.push_back(improved_row("city", kImprovedProjections, 187));
  rows.push_back(improved_row("forest", kPlainProjections, 50));
  const auto gains = improved_gains(rows);
  ASSERT_EQ(gains.size(), 1u) << "half a comparison is none";
  EXPECT_NEAR(gains[0].alone_percent.value(), 6.5, 1e-9);
  EXPECT_NEAR(gains[0].in_bake_percent.value(), 20, 1e-9);
  const auto table = chart_table(ChartKind::kIngredients, rows);
  ASSERT_TRUE(table.ok());
  EXPECT_NE(table->find("| city | 6.5 | 20.0 | 5 to 10 |"), std::string::npos) << *table;
  const auto spec = json::parse(*chart_spec(ChartKind::kIngredients, rows));
  const json& parts = spec["vconcat"];
  ASSERT_EQ(parts.size(), 3u);
  const json& band = parts[2]["layer"][0]["encoding"];
  EXPECT_EQ(band["x"]["datum"], kPaperLeastPercent);
  EXPECT_EQ(band["x2"]["datum"], kPaperMostPercent);
  EXPECT_EQ(spec["data"]["values"][0]["smaller_text"], "+20.0");
  EXPECT_EQ(spec["data"]["values"][0]["longer_text"], "+25");
}

constexpr const char* kStabilityLines =
    R"({"scene":"city","perturbation":"shrink","amount":0.01,"cells":9,"pvs_triangles":110,)"
    R"("base_pvs_triangles":100,"growth":1.1,"pvs_over_seen":1.2,"violations":0,"rays":1000})"
    "\n"
    R"({"scene":"city","perturbation":"split","amount":0,"cells":9,"pvs_triangles":100,)"
    R"("base_pvs_triangles":100,"growth":1,"pvs_over_seen":null,"violations":0,"rays":0})"
    "\n";

TEST(ChartStability, DrawsPerturbationsWithAndWithoutAnAmount) {
  const auto rows = parse_stability_rows(kStabilityLines, "s.jsonl");
  ASSERT_TRUE(rows.ok()) << rows.error().text;
  ASSERT_EQ(rows->size(), 2u);
  EXPECT_EQ((*rows)[0].amount, 0.01);
  EXPECT_EQ((*rows)[1].amount, 0);
  EXPECT_FALSE((*rows)[1].pvs_over_seen.has_value());
  const auto spec = stability_spec(*rows);
  ASSERT_TRUE(spec.ok());
  expect_whole(*spec);
  EXPECT_EQ(json::parse(*spec)["vconcat"].size(), 2u);
  EXPECT_NE(
      stability_table(*rows).find("| shrink | 0.01 | 1 | 9 | 110.0 | 110.0 | 110.0 | 1000 | 0 |"),
      std::string::npos);
  EXPECT_FALSE(parse_stability_rows("{}", "s.jsonl").ok());
}

class ChartDrawing : public testing::Test {
 protected:
  // A stand-in for vl2svg: `script` gets the specification's path and the picture's.
  Status draw(const std::string& script) {
    const std::string program = folder_.file("vl2svg");
    EXPECT_TRUE(write_file(program, "#!/bin/sh\n" + script + "\n").ok());
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    return draw_svg({.spec = "{\"a\":1}", .svg = folder_.file("out.svg"), .program = program});
  }
  TempFolder folder_;
};

TEST_F(ChartDrawing, HandsTheSpecificationToTheProgram) {
  ASSERT_TRUE(draw("{ echo '<svg>'; cat \"$1\"; } > \"$2\"").ok());
  EXPECT_EQ(*read_file(folder_.file("out.svg")), "<svg>\n{\"a\":1}");
  EXPECT_EQ(folder_.file_count(), 2u) << "something is left beside the program and the picture";
}

TEST_F(ChartDrawing, AFailureLeavesTheOldPicture) {
  ASSERT_TRUE(write_file(folder_.file("out.svg"), "old").ok());
  for (const char* script : {"echo half > \"$2\"; exit 3", "exit 0"}) {
    const Status drawn = draw(script);
    ASSERT_FALSE(drawn.ok()) << script;
    EXPECT_EQ(drawn.error().kind, ErrorKind::kRuntime);
    EXPECT_EQ(*read_file(folder_.file("out.svg")), "old");
    EXPECT_EQ(folder_.file_count(), 2u);
  }
}

TEST_F(ChartDrawing, AMissingProgramIsNamedAndHowToGetIt) {
  const Status drawn =
      draw_svg({.spec = "{}", .svg = folder_.file("out.svg"), .program = "no-such-vl2svg"});
  ASSERT_FALSE(drawn.ok());
  EXPECT_EQ(drawn.error().kind, ErrorKind::kUnsupported);
  EXPECT_NE(drawn.error().text.find("no-such-vl2svg"), std::string::npos);
  EXPECT_NE(drawn.error().text.find("--charts"), std::string::npos);
  EXPECT_EQ(folder_.file_count(), 0u);
}

}  // namespace
}  // namespace pvsfarm

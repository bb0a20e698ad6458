// The series that charts compare, and the figures that come out of their deltas.
#include <gtest/gtest.h>

#include <set>

#include "coordinator/chart/measure.hpp"
#include "coordinator/chart/sample.hpp"
#include "tests/unit/chart_samples.hpp"

namespace pvsfarm {
namespace {

constexpr Methods kProvers{Method::kProjection, Method::kFineProjection, Method::kSurfaces,
                           Method::kImproved,   Method::kSlices,         Method::kSweep};

TEST(ChartSeries, EveryPointIsWithinTheLimitsOfTheSettings) {
  std::set<std::string> names, colors;
  for (const Series& series : all_series()) {
    EXPECT_TRUE(names.insert(series.name).second) << series.name << " is there twice";
    EXPECT_EQ(series_named(series.name), &series);
    const auto points = series.points({});
    ASSERT_FALSE(points.empty()) << series.name;
    std::set<std::string> labels;
    for (const SeriesPoint& point : points) {
      const EvaluatorSettings& s = point.settings;
      EXPECT_TRUE(labels.insert(point.label).second) << series.name << ": " << point.label;
      EXPECT_TRUE(s.resolution_px >= 64 && s.resolution_px <= 1024) << point.label;
      EXPECT_TRUE(s.planes_per_face >= 1 && s.planes_per_face <= 16) << point.label;
      EXPECT_TRUE(s.extent >= 0.25 && s.extent <= 4) << point.label;
      EXPECT_TRUE(s.gap >= 0 && s.gap <= 1) << point.label;
      EXPECT_TRUE(s.item_buffer_px >= 32 && s.item_buffer_px <= 1024) << point.label;
      EXPECT_EQ((s.methods.bits() & kProvers.bits()) != 0, series.proves) << series.name;
    }
  }
  EXPECT_EQ(series_named("guesses"), nullptr);
}

TEST(ChartSeries, SamplingGoesUpToTheRaysAskedForAndNoFarther) {
  SeriesBase base;
  base.max_sampling_rays = 100'000;
  const auto points = series_named("sampling")->points(base);
  ASSERT_EQ(points.size(), 3u);
  EXPECT_EQ(points[0].label, "1e4 rays");
  EXPECT_EQ(points[1].settings.max_rays, 30'000u);
  EXPECT_EQ(points[2].settings.max_rays, 100'000u);
  EXPECT_EQ(points[2].settings.gap, 0) << "stopping early would flatter the rival";
}

TEST(ChartSample, TakesOneCellOfEveryStretchOfTheCurve) {
  std::vector<RootCell> cells;
  for (int i = 0; i < 100; ++i)
    cells.push_back({i, Cell::aligned({{double(i), 0, 0}, {i + 1.0, 1, 1}})});
  const auto sample = spread_sample(cells, 10, 5);
  ASSERT_EQ(sample.size(), 10u);
  std::set<std::uint32_t> tens;
  for (const std::uint32_t i : sample) tens.insert(i / 10);
  EXPECT_EQ(tens.size(), 10u);  // in a row of cells the curve is the row
  EXPECT_EQ(spread_sample(cells, 10, 5), sample);
  EXPECT_NE(spread_sample(cells, 10, 6), sample);
  EXPECT_EQ(spread_sample(cells, 1000, 5).size(), 100u);
}

// Hides and sees what the test says, by the settings' methods.
struct Pretender {
  std::vector<ChartTask> asked;
  double cpu_ms = 2;
  Result<std::vector<CellDelta>> operator()(std::span<const ChartTask> tasks) {
    std::vector<CellDelta> deltas;
    for (const ChartTask& task : tasks) {
      asked.push_back(task);
      CellDelta delta{.key = task.key, .hidden = set_of_four({}), .seen = set_of_four({})};
      if ((task.settings.methods.bits() & kProvers.bits()) != 0) delta.hidden = set_of_four({0});
      if (task.settings.methods.has(Method::kAimedRays)) delta.seen = set_of_four({1, 2});
      if (task.settings.methods.has(Method::kLookAround)) delta.seen = set_of_four({2});
      delta.statistics.cpu_ms = cpu_ms;
      deltas.push_back(std::move(delta));
    }
    return deltas;
  }
};

std::vector<ChartRow> rows_of(const ChartRequest& request, Pretender& pretender) {
  auto rows = measure(request, std::ref(pretender));
  EXPECT_TRUE(rows.ok()) << rows.error().text;
  return std::move(rows).value();
}

TEST(ChartMeasure, FiguresFollowFromWhatIsHiddenAndSeen) {
  ChartRequest request = row_of_boxes();
  request.series = {series_named("bake"), series_named("projection"), series_named("sampling")};
  request.base.max_sampling_rays = 10'000;
  Pretender pretender;
  const std::vector<ChartRow> rows = rows_of(request, pretender);
  ASSERT_EQ(rows.size(), 3u);
  const ChartRow &bake = rows[0], &projection = rows[1], &sampling = rows[2];
  EXPECT_EQ(bake.scene_objects, 4u);
  EXPECT_EQ(bake.scene_triangles, 48u);
  EXPECT_EQ(bake.cells, 4u);
  EXPECT_EQ(bake.cpu_ms, 2);
  EXPECT_EQ(bake.pvs_objects, 3);
  EXPECT_EQ(bake.culled_percent, 25);
  ASSERT_TRUE(bake.gap.has_value());
  EXPECT_DOUBLE_EQ(*bake.gap, 1.0 / 3);
  EXPECT_EQ(bake.pvs_over_seen_objects, 1.5);
  EXPECT_EQ(bake.found_objects, 1);
  EXPECT_FALSE(projection.gap.has_value()) << "it looked for nothing";
  EXPECT_EQ(projection.pvs_over_seen_triangles, 1.5) << "what others saw counts";
  EXPECT_EQ(projection.found_triangles, 0);
  EXPECT_FALSE(sampling.proves);
  EXPECT_FALSE(sampling.gap.has_value()) << "it certifies nothing";
  EXPECT_EQ(sampling.pvs_over_seen_objects, 0.5) << "half of what is seen is missing in its set";
  EXPECT_EQ(sampling.found_objects, 0.5);
  for (const ChartRow& row : rows) EXPECT_EQ(row.violations, 0u);
}

TEST(ChartMeasure, WhatOnePointHidesAndAnotherSawIsCounted) {
  ChartRequest request = row_of_boxes();
  request.sample = 3;
  request.series = {series_named("bake"), series_named("sampling")};
  request.base.max_sampling_rays = 10'000;
  Pretender honest;
  const EvaluateChartTasks lies = [&](std::span<const ChartTask> tasks) {
    auto deltas = honest(tasks);
    for (CellDelta& delta : *deltas)  // hides what sampling sees
      if (delta.hidden.count() > 0) delta.hidden = set_of_four({0, 2});
    return deltas;
  };
  const auto rows = measure(request, lies);
  ASSERT_TRUE(rows.ok());
  EXPECT_EQ((*rows)[0].violations, 3u);
  EXPECT_EQ((*rows)[1].violations, 0u);
}

TEST(ChartMeasure, EqualSettingsAreEvaluatedOnceARun) {
  ChartRequest request = row_of_boxes();
  request.runs = 1;
  request.series = {series_named("projection"), series_named("raster")};
  Pretender pretender;
  const auto rows = rows_of(request, pretender);
  ASSERT_EQ(rows.size(), 3u);  // projection alone; the same as direct; OSMesa
  EXPECT_EQ(pretender.asked.size(), 2u * request.cells.size());
  EXPECT_EQ(rows[0].cpu_ms, rows[1].cpu_ms);
  EXPECT_EQ(rows[2].raster, "osmesa");
}

TEST(ChartMeasure, AKeyIsTheCellsPlaceAmongAllCells) {
  ChartRequest request = row_of_boxes();
  request.sample = 2;
  request.runs = 1;
  request.series = {series_named("bake")};
  Pretender pretender;
  rows_of(request, pretender);
  ASSERT_EQ(pretender.asked.size(), 2u);
  for (const ChartTask& task : pretender.asked)
    EXPECT_EQ(task.cell, request.cells[task.key.root].cell) << "seeds are those of a bake";
}

TEST(ChartMeasure, TheLeastTimeOfSeveralRunsCounts) {
  ChartRequest request = row_of_boxes();
  request.series = {series_named("bake")};
  Pretender pretender;
  const EvaluateChartTasks disturbed = [&](std::span<const ChartTask> tasks) {
    pretender.cpu_ms = pretender.asked.empty() ? 50 : 2;
    return pretender(tasks);
  };
  const auto rows = measure(request, disturbed);
  ASSERT_TRUE(rows.ok());
  EXPECT_EQ((*rows)[0].cpu_ms_most, 2);
}

TEST(ChartMeasure, WhatTakesLongIsNotRepeated) {
  ChartRequest request = row_of_boxes();
  request.series = {series_named("bake")};
  Pretender slow;
  slow.cpu_ms = kLongEvaluation_ms + 1;
  rows_of(request, slow);
  EXPECT_EQ(slow.asked.size(), 4u);
  Pretender fast;
  rows_of(request, fast);
  EXPECT_EQ(fast.asked.size(), 8u);
}

TEST(ChartMeasure, TwoRunsThatDifferAreAnError) {
  ChartRequest request = row_of_boxes();
  request.series = {series_named("bake")};
  Pretender pretender;
  const EvaluateChartTasks fickle = [&](std::span<const ChartTask> tasks) {
    const bool again = !pretender.asked.empty();
    auto deltas = pretender(tasks);
    if (again) deltas->back().seen = set_of_four({1});
    return deltas;
  };
  const auto rows = measure(request, fickle);
  ASSERT_FALSE(rows.ok());
  EXPECT_EQ(rows.error().kind, ErrorKind::kRuntime);
  EXPECT_NE(rows.error().text.find("cell 10"), std::string::npos) << rows.error().text;
}

TEST(ChartMeasure, NoCellsAreAnErrorAndNotADivision) {
  ChartRequest request = row_of_boxes();
  request.series = {series_named("bake")};
  request.cells.clear();
  Pretender pretender;
  const auto rows = measure(request, std::ref(pretender));
  ASSERT_FALSE(rows.ok());
  EXPECT_EQ(rows.error().kind, ErrorKind::kInvalidInput);
}

}  // namespace
}  // namespace pvsfarm

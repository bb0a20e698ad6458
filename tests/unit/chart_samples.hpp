// Scenes and rows for the tests of charts.
#pragma once

#include <string>
#include <vector>

#include "coordinator/chart/measure.hpp"
#include "tests/unit/scene_shapes.hpp"

namespace pvsfarm {

// Four boxes of twelve triangles in a row, and four cells beside them.
inline ChartRequest row_of_boxes() {
  ChartRequest request;
  request.scene_name = "row";
  std::vector<SourceObject> objects;
  for (int i = 0; i < 4; ++i)
    objects.push_back(box_object("box", Box{{3.0 * i, 0, 0}, {3.0 * i + 1, 1, 2}}));
  request.scene = scene_of(std::move(objects));
  for (int i = 0; i < 4; ++i) {
    const double x = 3.0 * i;
    request.cells.push_back({100 + i, Cell::aligned({{x, -3, 1}, {x + 1, -2, 1.5}})});
  }
  return request;
}

inline VisibleSet set_of_four(std::initializer_list<std::uint32_t> ids) {
  std::uint64_t bits = 0;
  for (const std::uint32_t id : ids) bits |= std::uint64_t{1} << id;
  return VisibleSet::from_words(4, {bits});
}

inline ChartRow sample_row(const std::string& scene, const std::string& series, double value) {
  ChartRow row{.scene = scene,
               .scene_objects = 10,
               .scene_triangles = 120,
               .series = series,
               .label = series + " " + std::to_string(value),
               .value = value,
               .raster = "direct",
               .methods = "aimed-rays+projection"};
  row.proves = series != "sampling";
  row.resolution_px = 256;
  row.cells = 4;
  row.cells_in_all = 9;
  row.cpu_ms = 1.25 * (1 + value);
  row.cpu_ms_median = 1;
  row.cpu_ms_most = 3;
  row.culled_percent = 90;
  if (row.proves) row.gap = 0.125;
  row.pvs_over_seen_objects = 1.5;
  row.pvs_over_seen_triangles = 1.25;
  row.found_objects = 0.75;
  row.found_triangles = 0.875;
  return row;
}

}  // namespace pvsfarm

// One point of a series, measured on one scene: a line of the data file, a dot of a chart, a row of
// a table.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.hpp"

namespace pvsfarm {

struct ChartRow {
  std::string scene;
  std::uint64_t scene_objects = 0, scene_triangles = 0;  // of the occludees
  std::string series, label;                             // series.hpp
  double value = 0;
  bool proves = true;
  // The settings: enough to measure it again.
  std::string raster, methods;  // methods joined by '+'
  int resolution_px = 0, planes_per_face = 0, item_buffer_px = 0;
  double extent = 0, asked_gap = 0;
  std::uint64_t max_rays = 0;
  // Over the cells.
  std::uint64_t cells = 0, cells_in_all = 0;
  double cpu_ms = 0, cpu_ms_median = 0, cpu_ms_most = 0;  // a cell
  double pvs_objects = 0, pvs_triangles = 0;  // mean; what was seen, if it proves nothing
  double culled_percent = 0;                  // of the scene's triangles
  // Certified by the point itself: (|PVS| - |seen|) / |PVS| in triangles, of sums. Absent if it
  // proves nothing or looks for nothing.
  std::optional<double> gap;
  // Against the reference: of each cell all that any point of the run saw. Below 1: holes.
  double pvs_over_seen_objects = 0, pvs_over_seen_triangles = 0;
  double found_objects = 0, found_triangles = 0;  // share of the reference that it saw itself
  // Objects that it declared hidden and that it or another point saw. Not 0: a bug.
  std::uint64_t violations = 0;
};

// One JSON object without a newline.
std::string to_json(const ChartRow& row);
// Blank lines are skipped. Errors: kInvalidInput, naming `where` and the line.
Result<std::vector<ChartRow>> parse_chart_rows(std::string_view lines, const std::string& where);

}  // namespace pvsfarm

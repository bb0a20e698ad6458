#include "coordinator/chart/chart_row.hpp"

#include "coordinator/chart/json_lines.hpp"

namespace pvsfarm {
namespace {

// Calls f(key, field) of every field but the gap: what is written is what is read.
template <class Row, class F>
void for_each_field(Row& row, F&& f) {
  f("scene", row.scene);
  f("scene_objects", row.scene_objects);
  f("scene_triangles", row.scene_triangles);
  f("series", row.series);
  f("label", row.label);
  f("value", row.value);
  f("proves", row.proves);
  f("raster", row.raster);
  f("methods", row.methods);
  f("resolution_px", row.resolution_px);
  f("planes_per_face", row.planes_per_face);
  f("item_buffer_px", row.item_buffer_px);
  f("extent", row.extent);
  f("asked_gap", row.asked_gap);
  f("max_rays", row.max_rays);
  f("cells", row.cells);
  f("cells_in_all", row.cells_in_all);
  f("cpu_ms", row.cpu_ms);
  f("cpu_ms_median", row.cpu_ms_median);
  f("cpu_ms_most", row.cpu_ms_most);
  f("pvs_objects", row.pvs_objects);
  f("pvs_triangles", row.pvs_triangles);
  f("culled_percent", row.culled_percent);
  f("pvs_over_seen_objects", row.pvs_over_seen_objects);
  f("pvs_over_seen_triangles", row.pvs_over_seen_triangles);
  f("found_objects", row.found_objects);
  f("found_triangles", row.found_triangles);
  f("violations", row.violations);
}

}  // namespace

std::string to_json(const ChartRow& row) {
  nlohmann::ordered_json json;
  for_each_field(row, [&](const char* key, const auto& field) { json[key] = field; });
  json["gap"] = nullptr;
  if (row.gap) json["gap"] = *row.gap;
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

Result<std::vector<ChartRow>> parse_chart_rows(std::string_view lines, const std::string& where) {
  std::vector<ChartRow> rows;
  const Status read = for_each_json_line(
      lines, where, "a line that `pvsfarm chart --json` wrote", [&](const nlohmann::json& json) {
        ChartRow row;
        for_each_field(row, [&](const char* key, auto& field) { json.at(key).get_to(field); });
        if (const auto& gap = json.at("gap"); !gap.is_null()) row.gap = gap.get<double>();
        rows.push_back(std::move(row));
      });
  if (!read) return read.error();
  return rows;
}

}  // namespace pvsfarm

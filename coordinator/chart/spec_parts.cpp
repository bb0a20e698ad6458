#include "coordinator/chart/spec_parts.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>

#include "coordinator/chart/series.hpp"

namespace pvsfarm {

Json chart_frame() {
  return Json::parse(R"json({
    "$schema": "https://vega.github.io/schema/vega-lite/v5.json",
    "background": "white",
    "padding": 10,
    "config": {
      "font": "sans-serif",
      "axis": {"gridColor": "#e6e6e6", "domainColor": "#888888", "tickColor": "#888888",
               "labelColor": "#333333", "titleColor": "#333333", "titleFontWeight": "normal",
               "labelFontSize": 11, "titleFontSize": 12},
      "legend": {"labelFontSize": 12, "titleFontSize": 12, "labelLimit": 320, "symbolSize": 80,
                 "labelColor": "#333333"},
      "header": {"labelFontSize": 13, "labelFontWeight": "bold", "labelColor": "#222222",
                 "title": null},
      "title": {"fontSize": 14, "subtitleFontSize": 12, "anchor": "start", "offset": 12,
                "subtitleColor": "#555555"},
      "view": {"stroke": "#cccccc"},
      "line": {"strokeWidth": 2},
      "point": {"size": 36, "filled": true, "opacity": 1}
    }
  })json");
}

std::string legend_of(const std::string& series) {
  const Series* known = series_named(series);
  return known != nullptr ? known->legend : series;
}

std::vector<std::string> scenes_of(std::span<const ChartRow> rows) {
  std::vector<std::string> scenes;
  for (const ChartRow& row : rows)
    if (std::find(scenes.begin(), scenes.end(), row.scene) == scenes.end())
      scenes.push_back(row.scene);
  return scenes;
}

Json series_color(std::span<const ChartRow> rows) {
  Json domain = Json::array(), range = Json::array();
  for (const Series& series : all_series()) {
    const auto is_it = [&](const ChartRow& row) { return row.series == series.name; };
    if (std::none_of(rows.begin(), rows.end(), is_it)) continue;
    domain.push_back(series.legend);
    range.push_back(series.color);
  }
  return {{"field", "series"},
          {"type", "nominal"},
          {"title", nullptr},
          {"scale", {{"domain", domain}, {"range", range}}},
          {"legend", {{"orient", "bottom"}, {"columns", 3}, {"labelLimit", 500}}}};
}

Json scene_color(std::span<const ChartRow> rows) {
  return {{"field", "scene"},
          {"type", "nominal"},
          {"title", nullptr},
          {"scale", {{"domain", scenes_of(rows)}, {"scheme", "tableau10"}}},
          {"legend", {{"orient", "bottom"}, {"columns", 5}}}};
}

Json time_axis() {
  return Json::parse(R"json({"field": "cpu_ms", "type": "quantitative",
    "title": "CPU time a cell, ms", "scale": {"type": "log"},
    "axis": {"format": "~g", "values": [0.01, 0.1, 1, 10, 100, 1000, 10000, 100000, 1000000]}
  })json");
}

double rounded(double value) {
  std::array<char, 40> buffer;
  std::snprintf(buffer.data(), buffer.size(), "%.6g", value);
  return std::strtod(buffer.data(), nullptr);
}

}  // namespace pvsfarm

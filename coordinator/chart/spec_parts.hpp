// Pieces that the charts have in common.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "coordinator/chart/chart_row.hpp"

namespace pvsfarm {

using Json = nlohmann::ordered_json;

// A specification without data: schema, white ground, fonts, thin grid.
Json chart_frame();

std::string legend_of(const std::string& series);  // the name itself, if nothing is so called

// Different values in order of appearance.
std::vector<std::string> scenes_of(std::span<const ChartRow> rows);

// Color by field "series", in the registry's order and colors, of those series that rows have.
Json series_color(std::span<const ChartRow> rows);
// Color by field "scene".
Json scene_color(std::span<const ChartRow> rows);

// CPU time along x.
Json time_axis();

// Six significant digits: data need no more, and files stay small.
double rounded(double value);

}  // namespace pvsfarm

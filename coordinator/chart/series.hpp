// What the chart of accuracy against time compares: named series of settings to evaluate cells
// with.
//
// To add one, whether of a new method or of a new setting, add an entry to the table in series.cpp:
// command line, legends and tables read it from there.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/pvs/settings.hpp"

namespace pvsfarm {

// One point of a curve.
struct SeriesPoint {
  std::string label;  // "256 px", for people
  double value = 0;   // of what the series varies
  EvaluatorSettings settings;
};

// What the points of every series start from.
struct SeriesBase {
  EvaluatorSettings settings;
  std::uint64_t max_sampling_rays = 10'000'000;  // a cell, of the series that only samples
};

struct Series {
  const char* name;    // of command lines and data files
  const char* legend;  // of charts and tables: few words
  const char* color;   // #rrggbb
  // False: no prover is in it, so it proves nothing hidden. Its set is what it saw.
  bool proves;
  // In the order of the curve.
  std::vector<SeriesPoint> (*points)(const SeriesBase& base);
};

// The point of the series "ingredients" that the others are set against.
inline constexpr const char* kAllIngredients = "a bake's methods";
// What the labels of the others begin with, before the method's name.
inline constexpr std::string_view kWith = "with ", kWithout = "without ";
// The points of the series "improved".
inline constexpr const char* kPlainProjections = "Projections";
inline constexpr const char* kImprovedProjections = "Projections, improved";

std::span<const Series> all_series();
const Series* series_named(std::string_view name);  // null: there is none

}  // namespace pvsfarm

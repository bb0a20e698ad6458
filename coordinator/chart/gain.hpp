// What each method gains and costs: the same cells with it and without it.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "coordinator/chart/chart_row.hpp"

namespace pvsfarm {

struct MethodGain {
  std::string scene, method;
  bool in_bake = false;  // one of the bake's methods, left out; else one of the others, put in
  double smaller_percent = 0;  // the PVS in triangles, with it: of what it is without it
  double longer_percent = 0;   // the processor time, likewise
};

// Of the rows of series "ingredients", each against the bake's methods of its own scene; a row
// without those is left out.
std::vector<MethodGain> method_gains(std::span<const ChartRow> rows);

// Durand 2000 (extended version), on a city: improved Projections make PVS 5 to 10 % smaller.
inline constexpr double kPaperLeastPercent = 5, kPaperMostPercent = 10;

// How much smaller the improved Projection of occludees makes a PVS.
struct ImprovedGain {
  std::string scene;
  std::optional<double> alone_percent;    // nothing but Projections, as in the paper
  std::optional<double> in_bake_percent;  // as a method among the bake's
};
// A scene each, in order of appearance; those that have neither figure are left out.
std::vector<ImprovedGain> improved_gains(std::span<const ChartRow> rows);

}  // namespace pvsfarm

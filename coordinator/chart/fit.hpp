// What charts and tables work out from measured points.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "coordinator/chart/chart_row.hpp"

namespace pvsfarm {

struct ChartPoint {
  double x = 0, y = 0;
};

// y = factor * x ^ exponent, by least squares in the logarithms. Points that are not positive are
// left out. Absent with fewer than two different x.
struct PowerLaw {
  double factor = 0, exponent = 0;
  double at(double x) const;
};
std::optional<PowerLaw> fit_power_law(std::span<const ChartPoint> points);

// The x where a curve through the points first reaches `wanted`: from point to point y goes with
// the logarithm of x. The first point's x, if it is there already. Absent if it never gets there.
// Requires: x ascending and positive.
std::optional<double> where_reached(std::span<const ChartPoint> points, double wanted);

// The cascade against sampling on one scene.
struct RivalComparison {
  const ChartRow* ours = nullptr;
  const ChartRow* most_rays = nullptr;  // the longest run of sampling
  std::optional<double> rival_ms;       // absent: even the longest run found less than asked for
  double ratio = 0;                     // of times; of the longest run's, at least, if absent
};
inline constexpr double kRivalShare = 0.995;  // of the objects seen, which the rival is to find
// Rows of series "bake" and "sampling" of one scene, in the order measured. Absent if one is
// missing. The pointers are into `rows`.
std::optional<RivalComparison> compare_with_sampling(std::span<const ChartRow> rows);

}  // namespace pvsfarm

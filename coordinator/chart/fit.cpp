#include "coordinator/chart/fit.hpp"

#include <cmath>

#include "common/base/check.hpp"

namespace pvsfarm {

double PowerLaw::at(double x) const { return factor * std::pow(x, exponent); }

std::optional<PowerLaw> fit_power_law(std::span<const ChartPoint> points) {
  double count = 0, sum_x = 0, sum_y = 0;
  const auto usable = [](const ChartPoint& p) { return p.x > 0 && p.y > 0; };
  for (const ChartPoint& p : points) {
    if (!usable(p)) continue;
    count += 1;
    sum_x += std::log(p.x);
    sum_y += std::log(p.y);
  }
  if (count < 2) return std::nullopt;
  // About the means, so that nothing cancels.
  double xx = 0, xy = 0;
  for (const ChartPoint& p : points) {
    if (!usable(p)) continue;
    const double x = std::log(p.x) - sum_x / count;
    xx += x * x;
    xy += x * (std::log(p.y) - sum_y / count);
  }
  if (!(xx > 1e-12)) return std::nullopt;
  const double exponent = xy / xx;
  return PowerLaw{.factor = std::exp((sum_y - exponent * sum_x) / count), .exponent = exponent};
}

std::optional<double> where_reached(std::span<const ChartPoint> points, double wanted) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    PVS_CHECK(points[i].x > 0);
    if (points[i].y < wanted) continue;
    if (i == 0) return points[0].x;
    const ChartPoint &before = points[i - 1], &after = points[i];
    const double t = (wanted - before.y) / (after.y - before.y);
    return before.x * std::pow(after.x / before.x, t);
  }
  return std::nullopt;
}

std::optional<RivalComparison> compare_with_sampling(std::span<const ChartRow> rows) {
  RivalComparison out;
  std::vector<ChartPoint> curve;
  for (const ChartRow& row : rows) {
    if (row.series == "bake") out.ours = &row;
    if (row.series != "sampling" || !(row.cpu_ms > 0)) continue;
    curve.push_back({row.cpu_ms, row.found_objects});
    out.most_rays = &row;
  }
  if (out.ours == nullptr || out.most_rays == nullptr || !(out.ours->cpu_ms > 0))
    return std::nullopt;
  out.rival_ms = where_reached(curve, kRivalShare);
  out.ratio = out.rival_ms.value_or(out.most_rays->cpu_ms) / out.ours->cpu_ms;
  return out;
}

}  // namespace pvsfarm

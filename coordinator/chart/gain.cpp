#include "coordinator/chart/gain.hpp"

#include <algorithm>
#include <string_view>

#include "coordinator/chart/series.hpp"
#include "coordinator/chart/spec_parts.hpp"

namespace pvsfarm {
namespace {

// How much smaller `with` is than `without`, in percent; negative: larger.
double smaller_percent(double with, double without) {
  return without > 0 ? 100 * (1 - with / without) : 0;
}

const ChartRow* row_of(std::span<const ChartRow> rows, const std::string& scene,
                       std::string_view series, std::string_view label) {
  const auto found = std::find_if(rows.begin(), rows.end(), [&](const ChartRow& row) {
    return row.scene == scene && row.series == series && row.label == label;
  });
  return found == rows.end() ? nullptr : &*found;
}

}  // namespace

std::vector<MethodGain> method_gains(std::span<const ChartRow> rows) {
  std::vector<MethodGain> gains;
  for (const ChartRow& row : rows) {
    const ChartRow* bake = row_of(rows, row.scene, "ingredients", kAllIngredients);
    if (row.series != "ingredients" || bake == nullptr || bake == &row) continue;
    const std::string_view label = row.label;
    const bool left_out = label.starts_with(kWithout);
    if (!left_out && !label.starts_with(kWith)) continue;
    const ChartRow& with = left_out ? *bake : row;
    const ChartRow& without = left_out ? row : *bake;
    const std::string_view mark = left_out ? kWithout : kWith;
    gains.push_back({.scene = row.scene,
                     .method = std::string(label.substr(mark.size())),
                     .in_bake = left_out,
                     .smaller_percent = smaller_percent(with.pvs_triangles, without.pvs_triangles),
                     .longer_percent = -smaller_percent(with.cpu_ms, without.cpu_ms)});
  }
  return gains;
}

std::vector<ImprovedGain> improved_gains(std::span<const ChartRow> rows) {
  const std::vector<MethodGain> methods = method_gains(rows);
  std::vector<ImprovedGain> gains;
  for (const std::string& scene : scenes_of(rows)) {
    ImprovedGain gain{.scene = scene, .alone_percent = {}, .in_bake_percent = {}};
    const ChartRow* plain = row_of(rows, scene, "improved", kPlainProjections);
    const ChartRow* improved = row_of(rows, scene, "improved", kImprovedProjections);
    if (plain != nullptr && improved != nullptr)
      gain.alone_percent = smaller_percent(improved->pvs_triangles, plain->pvs_triangles);
    for (const MethodGain& method : methods)
      if (method.scene == scene && method.method == to_string(Method::kImproved))
        gain.in_bake_percent = method.smaller_percent;
    if (gain.alone_percent || gain.in_bake_percent) gains.push_back(gain);
  }
  return gains;
}

}  // namespace pvsfarm

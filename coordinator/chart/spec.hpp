// Charts as Vega-Lite specifications with their data in them: https://vega.github.io/vega-lite/
// Any Vega-Lite program draws them; nothing here does.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/chart/chart_row.hpp"
#include "coordinator/chart/stability_row.hpp"

namespace pvsfarm {

enum class ChartKind : std::uint8_t {
  kAccuracy,     // PVS over seen and certified gap against time, one curve a series, by scene
  kResolution,   // Durand 2000, Fig. 10: time and culling against the resolution of the maps
  kScale,        // Durand 2000, Fig. 11: time against the size of the scene
  kRival,        // what random rays miss after how long, beside the time of the cascade
  kIngredients,  // what each method gains and costs: the bake with one more or one less
  kStability,    // how much PVSs grow when the scene or the cell is perturbed
};
inline constexpr ChartKind kChartKinds[] = {ChartKind::kAccuracy,    ChartKind::kResolution,
                                            ChartKind::kScale,       ChartKind::kRival,
                                            ChartKind::kIngredients, ChartKind::kStability};
const char* to_string(ChartKind kind);  // "accuracy", "resolution", ...
std::optional<ChartKind> chart_kind_named(std::string_view name);

// The names of the series that a chart shows. Requires: not kStability.
std::vector<std::string> series_shown(ChartKind kind);
// The rows that a chart shows. Errors: kInvalidInput, if there is none. Requires: not kStability.
Result<std::vector<ChartRow>> rows_shown(ChartKind kind, std::span<const ChartRow> rows);

// JSON text. Errors: as rows_shown; kInvalidInput without stability rows. Requires: not kStability.
Result<std::string> chart_spec(ChartKind kind, std::span<const ChartRow> rows);
// What chart_spec gives for kIngredients. Errors: kInvalidInput, if no method can be set against
// a bake without it.
Result<std::string> ingredients_spec(std::span<const ChartRow> rows);
Result<std::string> stability_spec(std::span<const StabilityRow> rows);

}  // namespace pvsfarm

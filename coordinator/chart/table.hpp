// The figures of a chart as a Markdown table.
#pragma once

#include <span>
#include <string>

#include "coordinator/chart/spec.hpp"

namespace pvsfarm {

// kAccuracy, kResolution: a line a row, of the series that the chart shows. kScale: a line a scene
// size, and the fitted exponents. kRival: the two lines and the ratio, of one scene. kIngredients:
// a line a row, with what it changes against the bake's methods; then the improved Projection's
// gain, a line a scene, beside the paper's. Errors: as chart_spec. Requires: not kStability.
Result<std::string> chart_table(ChartKind kind, std::span<const ChartRow> rows);
// A line a perturbation, over all scenes.
std::string stability_table(std::span<const StabilityRow> rows);

}  // namespace pvsfarm

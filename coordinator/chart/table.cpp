#include "coordinator/chart/table.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>

#include "coordinator/chart/fit.hpp"
#include "coordinator/chart/gain.hpp"
#include "coordinator/chart/series.hpp"
#include "coordinator/chart/spec_parts.hpp"

namespace pvsfarm {
namespace {

std::string number(double value, int decimals) {
  std::array<char, 64> buffer;
  std::snprintf(buffer.data(), buffer.size(), "%.*f", decimals, value);
  return buffer.data();
}

// About three digits, whatever the size: 0.123, 12.3, 1234.
std::string milliseconds(double value) {
  return number(value, value < 1 ? 3 : value < 10 ? 2 : value < 100 ? 1 : 0);
}

std::string percent_or_dash(const std::optional<double>& share) {
  return share ? number(100 * *share, 1) : "-";
}

std::string line(std::initializer_list<std::string> fields) {
  std::string text = "|";
  for (const std::string& field : fields) text += " " + field + " |";
  return text + "\n";
}

std::string heading(std::initializer_list<std::string> fields) {
  std::string text = line(fields) + "|";
  for (std::size_t i = 0; i < fields.size(); ++i) text += "---|";
  return text + "\n";
}

std::string points(std::span<const ChartRow> rows) {
  std::string text = heading({"scene", "what", "point", "cells", "CPU, ms", "median", "slowest",
                              "gap, %", "PVS / seen, objects", "triangles", "culled, %", "wrong"});
  for (const ChartRow& row : rows) {
    text += line({row.scene, legend_of(row.series), row.label,
                  std::to_string(row.cells) + " of " + std::to_string(row.cells_in_all),
                  milliseconds(row.cpu_ms), milliseconds(row.cpu_ms_median),
                  milliseconds(row.cpu_ms_most), percent_or_dash(row.gap),
                  number(row.pvs_over_seen_objects, 3), number(row.pvs_over_seen_triangles, 3),
                  row.proves ? number(row.culled_percent, 1) : "none proved",
                  std::to_string(row.violations)});
  }
  return text;
}

std::string scales(std::span<const ChartRow> rows) {
  std::string text = heading(
      {"what", "scene", "objects", "triangles", "cells", "CPU, ms", "culled, %", "PVS, objects"});
  std::string exponents;
  for (const Series& series : all_series()) {
    std::vector<ChartPoint> curve;
    for (const ChartRow& row : rows) {
      if (row.series != series.name) continue;
      curve.push_back({static_cast<double>(row.scene_triangles), row.cpu_ms});
      text += line({series.legend, row.scene, std::to_string(row.scene_objects),
                    std::to_string(row.scene_triangles), std::to_string(row.cells),
                    milliseconds(row.cpu_ms), number(row.culled_percent, 1),
                    number(row.pvs_objects, 1)});
    }
    if (const auto law = fit_power_law(curve))
      exponents += std::string(exponents.empty() ? "" : "; ") + series.legend + ": " +
                   number(law->exponent, 2);
  }
  if (!exponents.empty())
    text +=
        "\nFitted exponent of the time over the number of triangles (least squares in the "
        "logarithms): " +
        exponents + ".\n";
  return text;
}

std::string change(double value, double base) {
  if (!(base > 0)) return "-";
  std::array<char, 64> buffer;
  std::snprintf(buffer.data(), buffer.size(), "%+.1f", 100 * (value / base - 1));
  return buffer.data();
}

std::string ingredients(std::span<const ChartRow> rows) {
  std::string text =
      heading({"scene", "methods", "CPU, ms", "change, %", "PVS, triangles", "change, %",
               "PVS / seen, triangles", "gap, %", "culled, %", "wrong"});
  for (const ChartRow& row : rows) {
    if (row.series != "ingredients") continue;
    const auto base = std::find_if(rows.begin(), rows.end(), [&](const ChartRow& other) {
      return other.scene == row.scene && other.label == kAllIngredients;
    });
    const bool is_base = base == rows.end() || &*base == &row;
    text += line({row.scene, row.label, milliseconds(row.cpu_ms),
                  is_base ? "" : change(row.cpu_ms, base->cpu_ms), number(row.pvs_triangles, 0),
                  is_base ? "" : change(row.pvs_triangles, base->pvs_triangles),
                  number(row.pvs_over_seen_triangles, 3), percent_or_dash(row.gap),
                  number(row.culled_percent, 2), std::to_string(row.violations)});
  }
  const std::vector<ImprovedGain> improved = improved_gains(rows);
  if (improved.empty()) return text;
  text += "\n" + heading({"scene", "improved Projection, with Projections alone: PVS smaller by, %",
                          "among the bake's methods, %", "Durand 2000, on a city, %"});
  const auto one_decimal = [](const std::optional<double>& percent) {
    return percent ? number(*percent, 1) : "-";
  };
  const std::string paper = number(kPaperLeastPercent, 0) + " to " + number(kPaperMostPercent, 0);
  for (const ImprovedGain& gain : improved)
    text += line(
        {gain.scene, one_decimal(gain.alone_percent), one_decimal(gain.in_bake_percent), paper});
  return text;
}

Result<std::string> rivals(std::span<const ChartRow> rows) {
  if (scenes_of(rows).size() != 1)
    return invalid_input("a comparison with sampling is of one scene");
  const auto found = compare_with_sampling(rows);
  if (!found)
    return invalid_input("a comparison with sampling needs rows of the series bake and sampling");
  const ChartRow& ours = *found->ours;
  std::string text = heading({"what", "point", "CPU, ms a cell", "found of what is seen, %",
                              "certified gap, %", "proves what is hidden"});
  for (const ChartRow& row : rows)
    text += line({legend_of(row.series), row.label, milliseconds(row.cpu_ms),
                  row.proves ? "100 (keeps what it cannot prove hidden)"
                             : number(100 * row.found_objects, 2),
                  percent_or_dash(row.gap), row.proves ? "yes" : "no"});
  const std::string share = number(100 * kRivalShare, 1) + " %";
  text += "\n" + ours.scene + ", " + std::to_string(ours.cells) +
          " cells: the cascade certifies a gap of " + percent_or_dash(ours.gap) +
          " % (PVS / seen " + number(ours.pvs_over_seen_triangles, 3) + " in triangles) in " +
          milliseconds(ours.cpu_ms) + " ms of CPU a cell, all told, with " +
          std::to_string(ours.violations) + " wrong. ";
  if (found->rival_ms)
    text += "Random rays find " + share + " of the objects seen in " +
            milliseconds(*found->rival_ms) + " ms: " + number(found->ratio, 1) +
            " times as long, and prove nothing.\n";
  else
    text += "Random rays have not found " + share + " of the objects seen after " +
            milliseconds(found->most_rays->cpu_ms) + " ms (" + found->most_rays->label + ": " +
            number(100 * found->most_rays->found_objects, 2) + " %): more than " +
            number(found->ratio, 1) + " times as long, and they prove nothing.\n";
  return text;
}

}  // namespace

Result<std::string> chart_table(ChartKind kind, std::span<const ChartRow> rows) {
  const auto shown = rows_shown(kind, rows);
  if (!shown) return shown.error();
  if (kind == ChartKind::kScale) return scales(*shown);
  if (kind == ChartKind::kRival) return rivals(*shown);
  if (kind == ChartKind::kIngredients) return ingredients(*shown);
  return points(*shown);
}

std::string stability_table(std::span<const StabilityRow> rows) {
  struct Sum {
    std::size_t scenes = 0;
    std::uint64_t cells = 0, violations = 0, rays = 0;
    std::vector<double> growth;
  };
  std::vector<std::pair<std::string, double>> order;  // as they come
  std::map<std::pair<std::string, double>, Sum> sums;
  for (const StabilityRow& row : rows) {
    const auto key = std::pair{row.perturbation, row.amount};
    if (!sums.contains(key)) order.push_back(key);
    Sum& sum = sums[key];
    ++sum.scenes;
    sum.cells += row.cells;
    sum.violations += row.violations;
    sum.rays += row.rays;
    if (row.growth) sum.growth.push_back(*row.growth);
  }
  std::string text =
      heading({"perturbation", "amount", "scenes", "cells",
               "PVS triangles, % of the unperturbed: median", "least", "most", "rays", "wrong"});
  for (const auto& key : order) {
    Sum& sum = sums[key];
    std::sort(sum.growth.begin(), sum.growth.end());
    const auto at = [&](std::size_t i) {
      return sum.growth.empty() ? "-" : number(100 * sum.growth[i], 1);
    };
    std::array<char, 40> amount{'-', 0};
    if (key.second > 0) std::snprintf(amount.data(), amount.size(), "%g", key.second);
    text += line({key.first, amount.data(), std::to_string(sum.scenes), std::to_string(sum.cells),
                  at(sum.growth.size() / 2), at(0), at(sum.growth.size() - 1),
                  std::to_string(sum.rays), std::to_string(sum.violations)});
  }
  return text;
}

}  // namespace pvsfarm

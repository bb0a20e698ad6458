#include "coordinator/chart/spec.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "coordinator/chart/fit.hpp"
#include "coordinator/chart/series.hpp"
#include "coordinator/chart/spec_parts.hpp"

namespace pvsfarm {
namespace {

constexpr std::array<const char*, 6> kNames{"accuracy", "resolution",  "scale",
                                            "rival",    "ingredients", "stability"};
constexpr std::size_t kPanelsInARow = 4;

std::string text_of(const Json& spec) { return spec.dump(1) + "\n"; }

Json gap_axis() {
  return Json::parse(R"json({"field": "gap", "type": "quantitative", "title": "certified gap",
    "scale": {"domain": [0, 1]}, "axis": {"format": "%"}})json");
}

Json found_axis() {
  return Json::parse(R"json({"field": "found", "type": "quantitative",
    "title": "found of what is seen",
    "scale": {"domain": [0, 1]}, "axis": {"format": "%"}})json");
}

// Of what proves: from 1, where nothing is left to gain, to the loosest.
Json looseness_axis(std::span<const ChartRow> rows) {
  double most = 1.3, least = 1;
  for (const ChartRow& row : rows) {
    if (!row.proves) continue;
    most = std::max(most, row.pvs_over_seen_triangles);
    least = std::min(least, row.pvs_over_seen_triangles);
  }
  const double low = rounded(least / std::pow(most / least, 0.05)), high = rounded(most * 1.1);
  Json axis = Json::parse(R"json({"field": "pvs_over_seen", "type": "quantitative",
    "title": "PVS / seen, triangles",
    "axis": {"format": "~g", "values": [0.7, 1, 1.1, 1.2, 1.3, 1.5, 2, 3, 4, 6, 10, 15, 30, 50,
                                        100]}})json");
  axis["scale"] = {{"type", "log"}, {"domain", {low, high}}, {"nice", false}};
  return axis;
}

enum class Panel { kLooseness, kGap, kFound };

// PVS over seen, the gap, or what those find that prove nothing: one panel a scene.
Json accuracy_panels(std::span<const ChartRow> rows, Panel panel) {
  const std::vector<std::string> scenes = scenes_of(rows);
  const bool one = scenes.size() == 1;
  Json layers = Json::array();
  if (panel == Panel::kLooseness)
    layers.push_back(Json::parse(R"json({
      "transform": [{"aggregate": [{"op": "count", "as": "n"}], "groupby": ["scene"]}],
      "mark": {"type": "rule", "color": "#444444", "strokeDash": [4, 3]},
      "encoding": {"y": {"datum": 1}}})json"));
  Json encoding;
  encoding["x"] = time_axis();
  encoding["y"] = panel == Panel::kGap     ? gap_axis()
                  : panel == Panel::kFound ? found_axis()
                                           : looseness_axis(rows);
  encoding["color"] = series_color(rows);
  if (one) encoding["color"]["legend"]["columns"] = 2;
  layers.push_back({{"mark", {{"type", "point"}, {"clip", true}}}, {"encoding", encoding}});
  encoding["order"] = {{"field", "value"}, {"type", "quantitative"}};
  layers.push_back({{"mark", {{"type", "line"}, {"clip", true}}}, {"encoding", encoding}});
  return {
      {"facet", {{"field", "scene"}, {"type", "nominal"}, {"sort", scenes}, {"title", nullptr}}},
      {"columns", std::min(scenes.size(), kPanelsInARow)},
      {"spec",
       {{"width", one ? 520 : 215}, {"height", one ? 260 : 170}, {"layer", std::move(layers)}}}};
}

Json accuracy(std::span<const ChartRow> rows) {
  Json values = Json::array();
  bool any_gap = false, any_found = false;
  for (const ChartRow& row : rows) {
    Json value{{"scene", row.scene},
               {"series", legend_of(row.series)},
               {"label", row.label},
               {"value", row.value},
               {"cpu_ms", rounded(row.cpu_ms)}};
    // What proves nothing has no PVS, only what it found.
    (row.proves ? value["pvs_over_seen"] : value["found"]) =
        rounded(row.proves ? row.pvs_over_seen_triangles : row.found_triangles);
    any_found |= !row.proves;
    value["gap"] = row.gap ? Json(rounded(*row.gap)) : Json(nullptr);
    any_gap |= row.gap.has_value() && row.series != "bake";  // one dot is no curve
    values.push_back(std::move(value));
  }
  Json spec = chart_frame();
  spec["title"] = Json::parse(R"json({"text": "Accuracy against time",
    "subtitle": ["PVS / seen: of what any method saw; 1: nothing is left to gain",
                 "Certified gap: the part of a PVS that its own run has not seen",
                 "Found: what random rays alone, which prove nothing, see of it"]})json");
  spec["data"]["values"] = std::move(values);
  spec["vconcat"] = Json::array({accuracy_panels(rows, Panel::kLooseness)});
  if (any_gap) spec["vconcat"].push_back(accuracy_panels(rows, Panel::kGap));
  if (any_found) spec["vconcat"].push_back(accuracy_panels(rows, Panel::kFound));
  return spec;
}

Json resolution(std::span<const ChartRow> rows) {
  Json spec = chart_frame();
  spec["title"] = Json::parse(R"json({"text": "Time and culling against the resolution of the maps",
    "subtitle": "Projections alone; after Durand 2000, Fig. 10"})json");
  Json values = Json::array();
  for (const ChartRow& row : rows)
    values.push_back({{"scene", row.scene},
                      {"resolution_px", row.resolution_px},
                      {"cpu_ms", rounded(row.cpu_ms)},
                      {"culled", rounded(row.culled_percent)}});
  spec["data"]["values"] = std::move(values);
  const auto panel = [&](const char* y) {
    Json out = Json::parse(R"json({"width": 360, "height": 260,
      "mark": {"type": "line", "point": true},
      "encoding": {"x": {"field": "resolution_px", "type": "ordinal",
                         "title": "pixels a side of a map", "axis": {"labelAngle": 0}}}})json");
    out["encoding"]["y"] = Json::parse(y);
    out["encoding"]["color"] = scene_color(rows);
    return out;
  };
  spec["hconcat"] = Json::array(
      {panel(R"json({"field": "cpu_ms", "type": "quantitative", "title": "CPU time a cell, ms",
                 "scale": {"type": "log"}, "axis": {"tickCount": 6, "format": "~g"}})json"),
       panel(R"json({"field": "culled", "type": "quantitative",
                 "title": "culled, % of the scene's triangles", "scale": {"zero": false}})json")});
  return spec;
}

// The points, and the power law of each series as a line from its least to its largest scene.
Json scale(std::span<const ChartRow> rows) {
  Json values = Json::array();
  std::map<std::string, std::vector<ChartPoint>> points;
  for (const ChartRow& row : rows) {
    const auto triangles = static_cast<double>(row.scene_triangles);
    points[row.series].push_back({triangles, row.cpu_ms});
    values.push_back({{"series", legend_of(row.series)},
                      {"label", row.label},
                      {"scene_triangles", row.scene_triangles},
                      {"cpu_ms", rounded(row.cpu_ms)}});
  }
  std::string subtitle = "Least squares:";
  for (auto& [series, curve] : points) {
    std::sort(curve.begin(), curve.end(),
              [](const ChartPoint& a, const ChartPoint& b) { return a.x < b.x; });
    const auto law = fit_power_law(curve);
    if (!law) continue;
    for (const double x : {curve.front().x, curve.back().x})
      values.push_back({{"series", legend_of(series)},
                        {"scene_triangles", x},
                        {"fitted_ms", rounded(law->at(x))}});
    std::array<char, 64> exponent;
    std::snprintf(exponent.data(), exponent.size(), "%.2f", law->exponent);
    subtitle +=
        (subtitle.back() == ':' ? " " : "; ") + legend_of(series) + ": size ^ " + exponent.data();
  }
  Json spec = chart_frame();
  spec["title"] = {{"text", "Time against the size of the scene"},
                   {"subtitle", {"After Durand 2000, Fig. 11", subtitle}}};
  spec["data"]["values"] = std::move(values);
  spec["width"] = 520;
  spec["height"] = 300;
  spec["layer"] = Json::parse(R"json([
    {"transform": [{"filter": "isValid(datum.fitted_ms)"
}],
     "mark": {"type": "line", "strokeDash": [5, 4], "strokeWidth": 1.5},
     "encoding": {
  "y" : { "field" : "fitted_ms", "type" : "quantitative" }
}
},
    {"transform": [{"filter": "isValid(datum.cpu_ms)"}],
     "mark": {"type": "point", "size": 60},
     "encoding": {"y": {"field": "cpu_ms", "type": "quantitative"}}}
  ])json");
  spec["encoding"] = Json::parse(R"json({
    "x": {"field": "scene_triangles", "type": "quantitative", "title": "triangles of the scene",
          "scale": {"type": "log"}, "axis": {"tickCount": 6, "format": "~s"}},
    "y": {"type": "quantitative", "title": "CPU time a cell, ms", "scale": {"type": "log"},
          "axis": {"tickCount": 6, "format": "~g"}}})json");
  spec["encoding"]["color"] = series_color(rows);
  return spec;
}

constexpr double kLeastMissedPercent = 0.01;  // where none is drawn: a logarithm has no 0

Json rival(std::span<const ChartRow> rows) {
  Json values = Json::array();
  for (const ChartRow& row : rows) {
    // What the cascade has not seen it keeps: it misses nothing.
    const double missed = row.proves ? 0 : 100 - 100 * row.found_objects;
    values.push_back({{"scene", row.scene},
                      {"series", legend_of(row.series)},
                      {"label", row.label},
                      {"cpu_ms", rounded(row.cpu_ms)},
                      {"missed", rounded(std::max(missed, kLeastMissedPercent))}});
  }
  Json spec = chart_frame();
  spec["title"] = Json::parse(R"json({"text": "What random rays miss",
    "subtitle": "A bake misses nothing: what it cannot prove hidden stays visible"})json");
  spec["data"]["values"] = std::move(values);
  spec["width"] = 520;
  spec["height"] = 300;
  spec["layer"] = Json::parse(R"json([
    {"mark": {"type": "rule", "color": "#444444", "strokeDash": [4, 3]},
     "encoding": {"y": {}}},
    {"mark": "line"},
    {"mark": {"type": "point", "size": 60}},
    {"mark": {"type": "text", "align": "left", "dx": 7, "dy": -7, "fontSize": 11},
     "encoding": {"text": {"field": "label", "type": "nominal"}}}
  ])json");
  spec["layer"][0]["data"]["values"] = Json::array({Json::object()});
  spec["layer"][0]["encoding"]["y"]["datum"] = rounded(100 - 100 * kRivalShare);
  Json encoding = Json::parse(R"json({
    "y": {"field": "missed", "type": "quantitative", "title": "missed, % of the objects seen",
          "scale": {"type": "log"},
          "axis": {"format": "~g", "values": [0.01, 0.1, 0.5, 1, 5, 10, 50, 100]}}})json");
  encoding["x"] = time_axis();
  for (std::size_t i = 1; i < spec["layer"].size(); ++i) {
    Json& layer = spec["layer"][i];
    if (!layer.contains("encoding")) layer["encoding"] = Json::object();
    layer["encoding"].update(encoding);
    layer["encoding"]["color"] = series_color(rows);
  }
  return spec;
}

}  // namespace

const char* to_string(ChartKind kind) { return kNames[static_cast<std::size_t>(kind)]; }

std::optional<ChartKind> chart_kind_named(std::string_view name) {
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (name == kNames[i]) return static_cast<ChartKind>(i);
  return std::nullopt;
}

std::vector<std::string> series_shown(ChartKind kind) {
  PVS_CHECK(kind != ChartKind::kStability);
  if (kind == ChartKind::kResolution) return {"resolution"};
  if (kind == ChartKind::kScale) return {"bake", "projection"};
  if (kind == ChartKind::kRival) return {"bake", "sampling"};
  if (kind == ChartKind::kIngredients) return {"ingredients", "improved"};
  std::vector<std::string> curves;
  for (const Series& series : all_series())
    if (std::string_view(series.name) != "ingredients") curves.emplace_back(series.name);
  return curves;
}

Result<std::vector<ChartRow>> rows_shown(ChartKind kind, std::span<const ChartRow> rows) {
  const std::vector<std::string> series = series_shown(kind);
  std::vector<ChartRow> shown;
  for (const ChartRow& row : rows)
    if (std::find(series.begin(), series.end(), row.series) != series.end()) shown.push_back(row);
  if (shown.empty())
    return invalid_input(std::string("no row of a series that a chart of ") + to_string(kind) +
                         " shows");
  return shown;
}

Result<std::string> chart_spec(ChartKind kind, std::span<const ChartRow> rows) {
  const auto shown = rows_shown(kind, rows);
  if (!shown) return shown.error();
  if (kind == ChartKind::kResolution) return text_of(resolution(*shown));
  if (kind == ChartKind::kScale) return text_of(scale(*shown));
  if (kind == ChartKind::kRival) return text_of(rival(*shown));
  if (kind == ChartKind::kIngredients) return ingredients_spec(*shown);
  return text_of(accuracy(*shown));
}

}  // namespace pvsfarm

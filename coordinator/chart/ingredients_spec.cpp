#include <algorithm>
#include <array>
#include <cstdio>

#include "coordinator/chart/gain.hpp"
#include "coordinator/chart/spec.hpp"
#include "coordinator/chart/spec_parts.hpp"

namespace pvsfarm {
namespace {

constexpr const char* kGroups[] = {"a bake's methods, each left out", "the others, each put in"};
int group_of(const MethodGain& gain) { return gain.in_bake ? 0 : 1; }

constexpr const char *kGood = "#1f5fae", *kBad = "#c4572e";
constexpr const char* kAlone = "Projections alone";
constexpr const char* kInBake = "among the bake's methods";

// What a table of figures shows.
struct Figures {
  const char* field;
  const char* title;
  double darkest;          // [%] where the color is at its fullest
  const char *low, *high;  // colors of minus and plus that
};

constexpr Figures kGain{"smaller", "Gain: with the method a PVS is smaller by, %", 30, kBad, kGood};
constexpr Figures kCost{"longer", "Cost: with the method a cell takes longer by, %", 100, kGood,
                        kBad};

// The part of a table that has one group's methods: a line a scene, a column a method, the larger
// the darker. Scenes differ too much for one axis: what halves the PVS of one leaves another.
Json part_of_table(const Figures& figures, int group, const std::vector<std::string>& scenes,
                   const std::vector<std::string>& methods) {
  Json part = Json::parse(R"json({
    "width": {"step": 76}, "height": {"step": 21},
    "layer": [
      {"mark": {"type": "rect", "stroke": "white"},
       "encoding": {"color": {"type": "quantitative", "legend": null}}},
      {"mark": {"type": "text", "fontSize": 11},
       "encoding": {"text": {"type": "nominal"}, "color": {"value": "#222222"}}}
    ],
    "encoding": {
      "x": {"field": "method", "type": "nominal", "title": null,
            "axis": {"orient": "top", "labelAngle": 0, "ticks": false, "domain": false}},
      "y": {"field": "scene", "type": "nominal", "title": null,
            "axis": {"ticks": false, "domain": false, "labelLimit": 200}}
    }
  })json");
  const std::string field = figures.field;
  part["title"] = {{"text", kGroups[group]},
                   {"fontSize", 12},
                   {"fontWeight", "normal"},
                   {"anchor", "middle"},
                   {"offset", 4}};
  part["transform"] = Json::parse(R"json([{"filter": {"field": "group"}}])json");
  part["transform"][0]["filter"]["equal"] = kGroups[group];
  part["encoding"]["x"]["sort"] = methods;
  part["encoding"]["y"]["sort"] = scenes;
  if (group > 0) part["encoding"]["y"]["axis"] = nullptr;
  Json& color = part["layer"][0]["encoding"]["color"];
  color["field"] = field;
  color["scale"] = {{"domain", {-figures.darkest, 0, figures.darkest}},
                    {"range", {figures.low, "#f7f7f7", figures.high}},
                    {"clamp", true}};
  Json& text = part["layer"][1]["encoding"];
  text["text"]["field"] = field + "_text";
  const std::string dark = std::to_string(static_cast<int>(0.6 * figures.darkest));
  text["color"]["condition"] = {{"test", "abs(datum." + field + ") > " + dark}, {"value", "white"}};
  return part;
}

Json table(const Figures& figures, std::span<const MethodGain> gains,
           const std::vector<std::string>& scenes) {
  Json parts = Json::array();
  for (const int group : {0, 1}) {
    std::vector<std::string> methods;
    for (const MethodGain& gain : gains)
      if (group_of(gain) == group &&
          std::find(methods.begin(), methods.end(), gain.method) == methods.end())
        methods.push_back(gain.method);
    if (!methods.empty()) parts.push_back(part_of_table(figures, group, scenes, methods));
  }
  Json title{{"text", figures.title}, {"fontSize", 13}, {"anchor", "start"}};
  return {{"title", std::move(title)}, {"hconcat", std::move(parts)}};
}

// "+2.5"; "0" for what would be written as a nought with a sign.
std::string signed_text(double value, int decimals) {
  std::array<char, 64> buffer;
  std::snprintf(buffer.data(), buffer.size(), "%+.*f", decimals, value);
  const std::string text = buffer.data();
  return text.find_first_of("123456789") == std::string::npos ? "0" : text;
}

// The paper's figure as a band, ours as dots.
Json beside_the_paper(const std::vector<std::string>& scenes) {
  Json panel = Json::parse(R"json({
    "transform": [{"filter": "isValid(datum.improved)"}],
    "width": 520, "height": {"step": 21},
    "layer": [
      {"data": {"values": [{}]},
       "mark": {"type": "rect", "color": "#f2d9a0", "opacity": 0.6},
       "encoding": {"x": {"type": "quantitative"}, "x2": {}}},
      {"mark": {"type": "point", "size": 70},
       "encoding": {
         "x": {"field": "improved", "type": "quantitative",
               "title": "PVS smaller by, % of its triangles (band: Durand 2000, on a city)",
               "axis": {"grid": true}},
         "y": {"field": "scene", "type": "nominal", "title": null,
               "axis": {"labelLimit": 200, "grid": true}},
         "color": {"field": "of", "type": "nominal", "title": null,
                   "scale": {"range": ["#1f5fae", "#1a1a1a"]},
                   "legend": {"orient": "right"}}}}
    ]
  })json");
  panel["title"] = {{"text", "The improved Projection of occludees, beside its paper"},
                    {"fontSize", 13},
                    {"anchor", "start"}};
  panel["layer"][0]["encoding"]["x"]["datum"] = kPaperLeastPercent;
  panel["layer"][0]["encoding"]["x2"]["datum"] = kPaperMostPercent;
  Json& encoding = panel["layer"][1]["encoding"];
  encoding["y"]["sort"] = scenes;
  encoding["color"]["scale"]["domain"] = {kAlone, kInBake};
  return panel;
}

}  // namespace

Result<std::string> ingredients_spec(std::span<const ChartRow> rows) {
  const std::vector<MethodGain> gains = method_gains(rows);
  if (gains.empty()) return invalid_input("no method to set against a bake without it");
  Json values = Json::array();
  for (const MethodGain& gain : gains)
    values.push_back({{"scene", gain.scene},
                      {"method", gain.method},
                      {"group", kGroups[group_of(gain)]},
                      {"smaller", rounded(gain.smaller_percent)},
                      {"smaller_text", signed_text(gain.smaller_percent, 1)},
                      {"longer", rounded(gain.longer_percent)},
                      {"longer_text", signed_text(gain.longer_percent, 0)}});
  const std::vector<std::string> scenes = scenes_of(rows);
  Json tables = Json::array({table(kGain, gains, scenes), table(kCost, gains, scenes)});
  const std::vector<ImprovedGain> improved = improved_gains(rows);
  for (const ImprovedGain& gain : improved)
    for (const auto& [of, percent] :
         {std::pair{kAlone, gain.alone_percent}, std::pair{kInBake, gain.in_bake_percent}})
      if (percent)
        values.push_back({{"scene", gain.scene}, {"of", of}, {"improved", rounded(*percent)}});
  if (!improved.empty()) tables.push_back(beside_the_paper(scenes));
  Json spec = chart_frame();
  spec["title"] = Json::parse(R"json({"text": "What each method gains and costs",
    "subtitle": ["The same cells with the method and without it, going on to the end.",
                 "Blue is better: a smaller PVS, less time."]})json");
  spec["data"]["values"] = std::move(values);
  spec["vconcat"] = std::move(tables);
  spec["spacing"] = 28;
  return spec.dump(1) + "\n";
}

}  // namespace pvsfarm

#include "coordinator/chart/spec.hpp"
#include "coordinator/chart/spec_parts.hpp"

namespace pvsfarm {
namespace {

constexpr const char* kGrowthAxis = R"json({"field": "growth", "type": "quantitative",
  "title": "PVS, % of the unperturbed", "scale": {"type": "log", "nice": false},
  "axis": {"tickCount": 5, "format": "~g"}})json";

// Perturbations that have an amount: a panel each, a dot a scene, the scenes' median as a line.
Json amount_panels() {
  Json panels = Json::parse(R"json({
    "transform": [{"filter": "datum.amount > 0"}],
    "facet": {"field": "perturbation", "type": "nominal", "title": null},
    "columns": 4,
    "spec": {
      "width": 190, "height": 190,
      "layer": [
        {"mark": {"type": "point", "size": 22, "opacity": 0.45, "color": "#1f5fae"}},
        {"mark": {"type": "line", "color": "#1a1a1a", "strokeWidth": 1.5},
         "encoding": {"y": {"aggregate": "median"}}}
      ],
      "encoding": {"x": {"field": "amount", "type": "quantitative", "title": "amount",
                         "scale": {"type": "log"}, "axis": {"tickCount": 4, "format": "~g"}}}
    },
    "resolve": {"scale": {"x": "independent"}}
  })json");
  const Json growth = Json::parse(kGrowthAxis);
  panels["spec"]["encoding"]["y"] = growth;
  panels["spec"]["layer"][1]["encoding"]["y"] = growth;
  panels["spec"]["layer"][1]["encoding"]["y"]["aggregate"] = "median";
  return panels;
}

// The others: a line each, a dot a scene, the median as a tick.
Json strips() {
  Json panel = Json::parse(R"json({
    "transform": [{"filter": "!(datum.amount > 0)"}],
    "width": 520, "height": {"step": 22},
    "layer": [
      {"mark": {"type": "point", "size": 30, "opacity": 0.45, "color": "#1f5fae"}},
      {"mark": {"type": "tick", "color": "#1a1a1a", "thickness": 2, "size": 16}}
    ],
    "encoding": {"y": {"field": "perturbation", "type": "nominal", "title": null,
                       "axis": {"labelLimit": 260, "grid": true}}}
  })json");
  const Json growth = Json::parse(kGrowthAxis);
  panel["encoding"]["x"] = growth;
  panel["layer"][1]["encoding"]["x"] = growth;
  panel["layer"][1]["encoding"]["x"]["aggregate"] = "median";
  return panel;
}

}  // namespace

Result<std::string> stability_spec(std::span<const StabilityRow> rows) {
  Json values = Json::array();
  bool with_amount = false, without = false;
  for (const StabilityRow& row : rows) {
    if (row.perturbation == "none" || !row.growth || !(*row.growth > 0)) continue;
    values.push_back({{"scene", row.scene},
                      {"perturbation", row.perturbation},
                      {"amount", row.amount},
                      {"growth", rounded(100 * *row.growth)}});
    (row.amount > 0 ? with_amount : without) = true;
  }
  if (values.empty()) return invalid_input("no perturbation to draw");
  Json spec = chart_frame();
  spec["title"] = Json::parse(R"json({"text": "What perturbations do to visible sets",
    "subtitle": ["A dot is a scene; black: the median. 100 %: as large as without the perturbation"]
    })json");
  spec["data"]["values"] = std::move(values);
  spec["vconcat"] = Json::array();
  if (with_amount) spec["vconcat"].push_back(amount_panels());
  if (without) spec["vconcat"].push_back(strips());
  return spec.dump(1) + "\n";
}

}  // namespace pvsfarm

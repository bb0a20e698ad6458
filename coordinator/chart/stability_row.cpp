#include "coordinator/chart/stability_row.hpp"

#include "coordinator/chart/json_lines.hpp"

namespace pvsfarm {
namespace {

std::optional<double> number_if_any(const nlohmann::json& json, const char* key) {
  const auto it = json.find(key);
  if (it == json.end() || it->is_null()) return std::nullopt;
  return it->get<double>();
}

}  // namespace

Result<std::vector<StabilityRow>> parse_stability_rows(std::string_view lines,
                                                       const std::string& where) {
  std::vector<StabilityRow> rows;
  const Status read = for_each_json_line(
      lines, where, "a line of a stability run", [&](const nlohmann::json& json) {
        rows.push_back({.scene = json.at("scene"),
                        .perturbation = json.at("perturbation"),
                        .amount = number_if_any(json, "amount").value_or(0),
                        .cells = json.at("cells"),
                        .pvs_triangles = json.at("pvs_triangles"),
                        .base_pvs_triangles = json.at("base_pvs_triangles"),
                        .growth = number_if_any(json, "growth"),
                        .pvs_over_seen = number_if_any(json, "pvs_over_seen"),
                        .violations = json.at("violations"),
                        .rays = json.at("rays")});
      });
  if (!read) return read.error();
  return rows;
}

}  // namespace pvsfarm

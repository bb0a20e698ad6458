// A line of what tests/bench/stability_main.cpp prints: one perturbation of one scene.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.hpp"

namespace pvsfarm {

struct StabilityRow {
  std::string scene, perturbation;
  double amount = 0;  // 0 where a perturbation has none
  std::uint64_t cells = 0;
  double pvs_triangles = 0, base_pvs_triangles = 0;  // of all the cells
  // Of PVS triangles over the base's, and over those that rays saw; absent where that is 0.
  std::optional<double> growth, pvs_over_seen;
  std::uint64_t violations = 0, rays = 0;
};

// Blank lines are skipped. Errors: kInvalidInput, naming `where` and the line.
Result<std::vector<StabilityRow>> parse_stability_rows(std::string_view lines,
                                                       const std::string& where);

}  // namespace pvsfarm

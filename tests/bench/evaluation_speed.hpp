// What the evaluation of a cell costs, with its results checked: a fast wrong answer is an error.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/digest.hpp"
#include "common/pvs/settings.hpp"
#include "tests/bench/bench_scene.hpp"

namespace pvsfarm::bench {

struct EvaluationSpeed {
  std::vector<double> cpu_ms;  // a cell, the faster of two evaluations, ascending
  Digest results;              // of all deltas
  double mean_ms() const;
  double quantile_ms(double q) const;
};

// Evaluates every cell against all occludees, once in order and once in reverse, with two
// evaluators. Errors: kRuntime, if the two disagree on any cell.
Result<EvaluationSpeed> measure_evaluation(const std::shared_ptr<const Scene>& scene,
                                           std::span<const RootCell> cells,
                                           const EvaluatorSettings& settings);

}  // namespace pvsfarm::bench

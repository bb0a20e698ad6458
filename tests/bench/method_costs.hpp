// What each method of the cascade settles on a sample of cells, and what it takes: by the clock and
// at nominal prices (worker/evaluator/cascade.hpp), which this is for calibrating.
#pragma once

#include <memory>
#include <span>

#include "common/base/digest.hpp"
#include "common/pvs/delta.hpp"
#include "common/pvs/settings.hpp"
#include "tests/bench/bench_scene.hpp"

namespace pvsfarm::bench {

struct MethodCosts {
  StatisticsByMethod methods{};  // of all the cells
  CellStatistics work;           // likewise; its own `methods` are not used
  std::uint64_t pvs_triangles = 0, seen_triangles = 0, all_triangles = 0;
  double cpu_ms = 0;
  Digest hidden, seen;  // of all the cells' sets
};

// Evaluates every cell twice against all occludees; of the times the smaller counts, method by
// method.
MethodCosts measure_methods(const std::shared_ptr<const Scene>& scene,
                            std::span<const RootCell> cells, const EvaluatorSettings& settings);

}  // namespace pvsfarm::bench

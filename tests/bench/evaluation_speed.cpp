#include "tests/bench/evaluation_speed.hpp"

#include <algorithm>
#include <numeric>
#include <string>

#include "tests/bench/process.hpp"
#include "worker/evaluator/evaluator.hpp"

namespace pvsfarm::bench {

double EvaluationSpeed::mean_ms() const {
  return cpu_ms.empty() ? 0
                        : std::accumulate(cpu_ms.begin(), cpu_ms.end(), 0.0) /
                              static_cast<double>(cpu_ms.size());
}

double EvaluationSpeed::quantile_ms(double q) const {
  return cpu_ms.empty() ? 0 : cpu_ms[static_cast<std::size_t>(q * double(cpu_ms.size() - 1))];
}

Result<EvaluationSpeed> measure_evaluation(const std::shared_ptr<const Scene>& scene,
                                           std::span<const RootCell> cells,
                                           const EvaluatorSettings& settings) {
  const VisibleSet parent = all_occludees(*scene);
  const auto key_of = [](std::size_t i) { return CellKey{static_cast<std::uint32_t>(i), 1}; };
  EvaluationSpeed speed;
  speed.cpu_ms.resize(cells.size());
  std::vector<VisibleSet> hidden(cells.size());
  if (!cells.empty()) {
    Evaluator forward(scene, settings);
    forward.evaluate(key_of(0), cells[0].cell, parent);  // warm: shaders, buffers
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const double start_ms = process_cpu_ms();
      hidden[i] = forward.evaluate(key_of(i), cells[i].cell, parent).hidden;
      speed.cpu_ms[i] = process_cpu_ms() - start_ms;
    }
  }
  Evaluator backward(scene, settings);
  DigestBuilder digest;
  for (std::size_t i = cells.size(); i-- > 0;) {
    const double start_ms = process_cpu_ms();
    const VisibleSet again = backward.evaluate(key_of(i), cells[i].cell, parent).hidden;
    speed.cpu_ms[i] = std::min(speed.cpu_ms[i], process_cpu_ms() - start_ms);
    if (!(again == hidden[i]))
      return runtime_error("cell " + std::to_string(cells[i].id) +
                           ": two evaluations of it differ; the evaluator keeps something");
    digest.add(std::as_bytes(again.words()));
  }
  speed.results = digest.finish();
  std::sort(speed.cpu_ms.begin(), speed.cpu_ms.end());
  return speed;
}

}  // namespace pvsfarm::bench

#include "tests/bench/method_costs.hpp"

#include <algorithm>

#include "tests/bench/process.hpp"
#include "worker/evaluator/evaluator.hpp"

namespace pvsfarm::bench {
namespace {

void add(const MethodStatistics& from, MethodStatistics& to) {
  to.hidden_objects += from.hidden_objects;
  to.seen_objects += from.seen_objects;
  to.hidden_triangles += from.hidden_triangles;
  to.seen_triangles += from.seen_triangles;
  to.work += from.work;
  to.cpu_ms += from.cpu_ms;
}

}  // namespace

MethodCosts measure_methods(const std::shared_ptr<const Scene>& scene,
                            std::span<const RootCell> cells, const EvaluatorSettings& settings) {
  const VisibleSet parent = all_occludees(*scene);
  MethodCosts costs;
  DigestBuilder hidden, seen;
  Evaluator evaluator(scene, settings, process_cpu_ms);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const CellKey key{static_cast<std::uint32_t>(i), 1};
    const double start_ms = process_cpu_ms();
    CellDelta delta = evaluator.evaluate(key, cells[i].cell, parent);
    const double middle_ms = process_cpu_ms();
    const CellDelta again = evaluator.evaluate(key, cells[i].cell, parent);
    costs.cpu_ms += std::min(middle_ms - start_ms, process_cpu_ms() - middle_ms);
    for (int m = 0; m < kMethodCount; ++m) {
      MethodStatistics& own = delta.statistics.methods[m];
      own.cpu_ms = std::min(own.cpu_ms, again.statistics.methods[m].cpu_ms);
      add(own, costs.methods[m]);
    }
    costs.work.planes += delta.statistics.planes;
    costs.work.projections += delta.statistics.projections;
    costs.work.box_tests += delta.statistics.box_tests;
    hidden.add(std::as_bytes(delta.hidden.words()));
    seen.add(std::as_bytes(delta.seen.words()));
    VisibleSet visible = parent;
    visible.remove_all(delta.hidden);
    costs.pvs_triangles += triangles_in(*scene, visible);
    costs.seen_triangles += triangles_in(*scene, delta.seen);
    costs.all_triangles += triangles_in(*scene, parent);
  }
  costs.hidden = hidden.finish();
  costs.seen = seen.finish();
  return costs;
}

}  // namespace pvsfarm::bench

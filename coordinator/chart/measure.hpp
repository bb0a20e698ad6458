// Measures series on a sample of a scene's cells, whoever evaluates the cells.
//
// Every cell is evaluated on its own, against all occludees, as the roots of a bake are.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/cells/cell_source.hpp"
#include "common/pvs/delta.hpp"
#include "common/scene/scene.hpp"
#include "coordinator/chart/chart_row.hpp"
#include "coordinator/chart/series.hpp"

namespace pvsfarm {

// An evaluation to be made, anywhere: equal tasks give equal deltas, but for the times.
struct ChartTask {
  EvaluatorSettings settings;
  CellKey key;
  Cell cell;
};
// Evaluates all the tasks; the answers in their order, each with `statistics.cpu_ms`. Tasks of
// equal settings come in a row.
using EvaluateChartTasks =
    std::function<Result<std::vector<CellDelta>>(std::span<const ChartTask> tasks)>;

inline constexpr double kLongEvaluation_ms = 500;

struct ChartRequest {
  std::string scene_name;
  std::shared_ptr<const Scene> scene;
  std::vector<RootCell> cells;  // all of them
  std::size_t sample = 24;
  std::uint64_t seed = 1;  // of the sample
  std::vector<const Series*> series;
  SeriesBase base;
  // Of every evaluation; the least time counts, since disturbances only add. What took longer than
  // kLongEvaluation_ms is not repeated: it hardly notices them.
  int runs = 2;
};

// The rows of each series in turn. Points of equal settings are evaluated once.
// Errors: those of `evaluate`; kInvalidInput (no cells, no series); kRuntime, if two runs of one
// task gave different deltas.
Result<std::vector<ChartRow>> measure(const ChartRequest& request,
                                      const EvaluateChartTasks& evaluate);

}  // namespace pvsfarm

// Google Benchmark of one cell's evaluation: city of 8 x 8 blocks, 5 m street cells, 256 x 256.
// Every iteration's delta is compared with that of a fresh evaluator.
#include <benchmark/benchmark.h>

#include "tests/bench/bench_scene.hpp"
#include "worker/evaluator/evaluator.hpp"

namespace pvsfarm::bench {
namespace {

constexpr int kBlocks = 8;
constexpr std::size_t kCells = 16;

const BenchScene& city() {
  static const BenchScene scene = make_bench_scene("city", kBlocks, 5).value();
  return scene;
}

void evaluate_city(benchmark::State& state, RasterKind raster) {
  const BenchScene& bench = city();
  const std::vector<RootCell> cells = sample_cells(bench.cells, kCells, 1);
  const VisibleSet parent = all_occludees(*bench.scene);
  const EvaluatorSettings settings{.raster = raster};
  std::vector<VisibleSet> expected;
  double hidden_triangles = 0;
  {
    Evaluator fresh(bench.scene, settings);
    for (std::uint32_t i = 0; i < cells.size(); ++i) {
      expected.push_back(fresh.evaluate({i, 1}, cells[i].cell, parent).hidden);
      hidden_triangles += static_cast<double>(triangles_in(*bench.scene, expected[i]));
    }
  }
  Evaluator evaluator(bench.scene, settings);
  std::uint32_t at = 0;
  for (auto _ : state) {
    const CellDelta delta = evaluator.evaluate({at, 1}, cells[at].cell, parent);
    if (!(delta.hidden == expected[at])) {
      state.SkipWithError("the result is not that of a fresh evaluator");
      break;
    }
    at = (at + 1) % static_cast<std::uint32_t>(cells.size());
  }
  state.counters["culled_share"] =
      hidden_triangles /
      (static_cast<double>(triangles_in(*bench.scene, parent)) * static_cast<double>(cells.size()));
}

BENCHMARK_CAPTURE(evaluate_city, direct, RasterKind::kDirect)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(evaluate_city, osmesa, RasterKind::kOsmesa)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace pvsfarm::bench

BENCHMARK_MAIN();

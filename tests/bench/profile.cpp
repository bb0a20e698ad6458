#include "tests/bench/profile.hpp"

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "tests/bench/process.hpp"
#include "worker/evaluator/evaluator.hpp"
#include "worker/visibility/dispatch.hpp"

namespace pvsfarm::bench {
namespace {

// Additions, multiplications, comparisons and divisions of doubles in one operation of a stage,
// counted in its source; of a ray, what one node of a tree takes times its depth. Order of
// magnitude: they make a floor, not a forecast.
struct StageName {
  const char* name;
  const char* operation;
  double arithmetic;
};
constexpr std::array<StageName, kStageCount> kNames{{
    {"other", "", 0},
    {"occluders: rank, legality, cell's frame", "occluders", 12},
    {"planes: choose, aim", "planes", 0},
    {"maps: empty", "maps", 0},
    {"tiles that are wanted", "boxes a plane", 80},
    {"occluders: screen", "boxes a plane", 70},
    {"Projections", "pieces", 250},
    {"draw", "rows of 16 pixels", 0},
    {"pyramids", "maps", 0},
    {"occludees: test", "boxes a plane", 80},
    {"witnesses: aim", "rays", 100},
    {"witnesses: cast", "rays", 400},
    {"witnesses: check", "rays", 100},
    {"witnesses: past blockers", "rays", 600},
}};

PVSFARM_DISPATCH
void lower_all(float* to, const float* from, int n) {
  for (int i = 0; i < n; ++i) to[i] = from[i] < to[i] ? from[i] : to[i];
}
PVSFARM_DISPATCH
void multiply_and_add(double* sums, int n, int times) {
  for (int t = 0; t < times; ++t)
    for (int i = 0; i < n; ++i) sums[i] = sums[i] * 0.999 + 0.001;
}

// The best of many short runs: what disturbs only adds.
template <class Run>
double best_per_ms(double work, Run&& run) {
  double best_ms = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 200; ++i) {
    constexpr int kTimes = 20;
    const double start_ms = process_cpu_ms();
    for (int k = 0; k < kTimes; ++k) run();
    best_ms = std::min(best_ms, (process_cpu_ms() - start_ms) / kTimes);
  }
  return work / best_ms;
}

Machine measure_machine() {
  constexpr int kSide = 256, kPixels = kSide * kSide, kSums = 64, kRounds = 1000;
  std::vector<float> map(kPixels, 1), other(kPixels, 2);
  std::vector<double> sums(kSums, 1);
  Machine machine;
  // Read twice, written once.
  machine.bytes_per_ms = best_per_ms(3.0 * kPixels * sizeof(float),
                                     [&] { lower_all(map.data(), other.data(), kPixels); });
  machine.operations_per_ms =
      best_per_ms(2.0 * kSums * kRounds, [&] { multiply_and_add(sums.data(), kSums, kRounds); });
  return machine;
}

}  // namespace

const char* to_string(Stage stage) { return kNames[static_cast<std::size_t>(stage)].name; }

const char* operation_of(Stage stage) { return kNames[static_cast<std::size_t>(stage)].operation; }

double floor_ms(Stage stage, const StageWork& work, const Machine& machine) {
  const double arithmetic = kNames[static_cast<std::size_t>(stage)].arithmetic;
  return static_cast<double>(work.bytes) / machine.bytes_per_ms +
         static_cast<double>(work.operations) * arithmetic / machine.operations_per_ms;
}

Result<Profile> measure_profile(const std::shared_ptr<const Scene>& scene,
                                std::span<const RootCell> cells,
                                const EvaluatorSettings& settings) {
  const VisibleSet parent = all_occludees(*scene);
  Profile profile{.machine = measure_machine()};
  Evaluator evaluator(scene, settings);
  Stages stages{.clock = process_cpu_ms};
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const CellKey key{static_cast<std::uint32_t>(i), 1};
    evaluator.profile(nullptr);
    evaluator.evaluate(key, cells[i].cell, parent);
    const double start_ms = process_cpu_ms();
    const CellDelta plain = evaluator.evaluate(key, cells[i].cell, parent);
    stages.since_ms = process_cpu_ms();
    profile.cpu_ms += stages.since_ms - start_ms;
    evaluator.profile(&stages);
    const CellDelta told = evaluator.evaluate(key, cells[i].cell, parent);
    stages.work[0].cpu_ms += process_cpu_ms() - stages.since_ms;
    if (!(plain.hidden == told.hidden && plain.seen == told.seen))
      return runtime_error("cell " + std::to_string(cells[i].id) +
                           ": profiled, it came out otherwise");
  }
  const auto count = static_cast<double>(std::max<std::size_t>(cells.size(), 1));
  profile.cpu_ms /= count;
  profile.stages = stages.work;
  for (StageWork& work : profile.stages) {
    work.cpu_ms /= count;
    work.operations = static_cast<std::uint64_t>(static_cast<double>(work.operations) / count);
    work.bytes = static_cast<std::uint64_t>(static_cast<double>(work.bytes) / count);
  }
  return profile;
}

}  // namespace pvsfarm::bench

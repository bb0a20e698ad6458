// Where the time of a cell goes, step by step, and the least the same work could take: what it
// touches at the speed at which this machine touches anything.
#pragma once

#include <memory>
#include <span>

#include "common/base/result.hpp"
#include "common/pvs/settings.hpp"
#include "tests/bench/bench_scene.hpp"
#include "worker/visibility/stages.hpp"

namespace pvsfarm::bench {

// What the machine does at its best, one core, measured in the same run.
struct Machine {
  double bytes_per_ms = 0;       // a map in the cache, read and written in lanes
  double operations_per_ms = 0;  // additions and multiplications of doubles, in lanes
};

struct Profile {
  std::array<StageWork, kStageCount> stages{};  // of a cell, the mean
  double cpu_ms = 0;                            // of a cell, nobody being told where it goes
  Machine machine;
};

// Every cell is evaluated three times against all occludees: once to warm up, once for the whole
// time, once for the steps.
// Errors: kRuntime where telling the steps changed an answer.
Result<Profile> measure_profile(const std::shared_ptr<const Scene>& scene,
                                std::span<const RootCell> cells, const EvaluatorSettings& settings);

const char* to_string(Stage stage);
const char* operation_of(Stage stage);  // what its operations are
// The least a step can take, in milliseconds: its bytes and its arithmetic at the machine's best.
double floor_ms(Stage stage, const StageWork& work, const Machine& machine);

}  // namespace pvsfarm::bench

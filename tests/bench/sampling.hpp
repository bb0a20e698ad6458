// How much of what can be seen the product's sampler finds, and in which time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.hpp"
#include "common/pvs/settings.hpp"
#include "tests/bench/bench_scene.hpp"

namespace pvsfarm::bench {

struct SamplingRequest {
  EvaluatorSettings evaluator;               // makes the targets
  std::span<const std::uint64_t> rays;       // a cell, for the sampler; one row each
  std::uint64_t reference_rays = 4'000'000;  // a cell, for what it is compared with
  std::uint64_t seed = 1;
};

// Means over the cells.
struct SamplingRow {
  double found_objects_percent = 0;    // of the objects that the reference saw
  double found_triangles_percent = 0;  // the same weighted by triangles
  double beyond_objects = 0;           // seen by the sampler, not by the reference
  double rays = 0, checks = 0;
  double cpu_ms = 0;  // the least of three runs
};
struct Sampling {
  double targets = 0;            // objects not proved hidden
  double reference_objects = 0;  // of them seen by the reference
  double construction_ms = 0;
  std::vector<SamplingRow> rows;
};

Result<Sampling> measure_sampling(const BenchScene& bench, std::span<const RootCell> cells,
                                  const SamplingRequest& request);

}  // namespace pvsfarm::bench

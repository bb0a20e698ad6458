// How much is culled, and how much of what is left rays really see.
#pragma once

#include <cstdint>
#include <span>

#include "common/pvs/settings.hpp"
#include "tests/bench/bench_scene.hpp"

namespace pvsfarm::bench {

struct Culling {
  double visible_objects = 0;          // mean over cells, of the PVS
  double culled_triangle_percent = 0;  // of all occludees' triangles
  double pvs_over_seen_objects = 0;    // sums over cells
  double pvs_over_seen_triangles = 0;
  std::uint64_t violations = 0;  // objects declared hidden that a ray saw
};

// Evaluates each cell against all occludees, then casts `rays` rays from it: half in all
// directions, half at what the PVS holds and no ray has seen. What rays see is a lower bound of the
// truth, so the ratios are upper bounds of how loose the PVS is.
Result<Culling> measure_culling(const BenchScene& bench, std::span<const RootCell> cells,
                                const EvaluatorSettings& settings, std::uint64_t rays,
                                std::uint64_t seed);

}  // namespace pvsfarm::bench

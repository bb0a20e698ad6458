#include "tests/bench/sampling.hpp"

#include <algorithm>
#include <limits>

#include "tests/bench/process.hpp"
#include "tests/support/embree_witness.hpp"
#include "tests/support/ray_oracle.hpp"
#include "worker/evaluator/evaluator.hpp"
#include "worker/visibility/sampler.hpp"

namespace pvsfarm::bench {
namespace {

constexpr int kRuns = 3;

struct Reference {
  const BenchScene& bench;
  RayOracle oracle{bench.source};
  EmbreeWitness caster{bench.source, oracle};

  // By object id: seen by the tests' own rays.
  std::vector<char> seen(const Cell& cell, const VisibleSet& targets, std::uint64_t rays,
                         std::uint64_t seed) {
    const Scene& scene = *bench.scene;
    std::vector<std::uint32_t> positions;
    targets.for_each([&](ObjectId id) { positions.push_back(scene.object(id).file_index); });
    Random random(seed);
    const WitnessReport report = caster.sample(
        cell, {.uniform_rays = rays / 2, .aimed_rays = rays - rays / 2, .targets = positions},
        random);
    std::vector<char> result(scene.object_count(), 0);
    targets.for_each(
        [&](ObjectId id) { result[index_of(id)] = report.seen(scene.object(id).file_index); });
    return result;
  }
};

}  // namespace

Result<Sampling> measure_sampling(const BenchScene& bench, std::span<const RootCell> cells,
                                  const SamplingRequest& request) {
  const Scene& scene = *bench.scene;
  const VisibleSet everything = all_occludees(scene);
  Evaluator evaluator(bench.scene, request.evaluator);
  Reference reference{bench};
  Sampling result;
  const double start_ms = process_cpu_ms();
  Sampler sampler(bench.scene);
  result.construction_ms = process_cpu_ms() - start_ms;
  result.rows.resize(request.rays.size());
  const double part = 1 / static_cast<double>(cells.size());
  double reference_triangles = 0;
  for (std::uint32_t i = 0; i < cells.size(); ++i) {
    VisibleSet pvs = everything;
    pvs.remove_all(evaluator.evaluate({i, 1}, cells[i].cell, everything).hidden);
    const auto truth = reference.seen(cells[i].cell, pvs, request.reference_rays,
                                      request.seed * 0x9e3779b97f4a7c15ull + i);
    result.targets += pvs.count() * part;
    pvs.for_each([&](ObjectId id) {
      result.reference_objects += truth[index_of(id)] * part;
      reference_triangles += truth[index_of(id)] * part * scene.object(id).triangle_count;
    });
    for (std::size_t r = 0; r < result.rows.size(); ++r) {
      SamplingRow& row = result.rows[r];
      double least_ms = std::numeric_limits<double>::infinity();
      SamplingRound round;
      for (int run = 0; run < kRuns; ++run) {
        const double before_ms = process_cpu_ms();
        sampler.begin(cells[i].cell, request.seed + i, 0);
        round = sampler.aim(pvs, request.rays[r]);
        least_ms = std::min(least_ms, process_cpu_ms() - before_ms);
      }
      row.cpu_ms += least_ms * part;
      row.rays += static_cast<double>(round.rays) * part;
      row.checks += static_cast<double>(round.checks) * part;
      sampler.seen().for_each([&](ObjectId id) {
        const bool known = truth[index_of(id)];
        row.beyond_objects += !known * part;
        row.found_objects_percent += known * part;
        row.found_triangles_percent += known * part * scene.object(id).triangle_count;
      });
    }
  }
  for (SamplingRow& row : result.rows) {
    row.found_objects_percent *= 100 / result.reference_objects;
    row.found_triangles_percent *= 100 / reference_triangles;
  }
  return result;
}

}  // namespace pvsfarm::bench

#include "tests/bench/culling.hpp"

#include <vector>

#include "tests/support/embree_witness.hpp"
#include "tests/support/ray_oracle.hpp"
#include "worker/evaluator/evaluator.hpp"

namespace pvsfarm::bench {

Result<Culling> measure_culling(const BenchScene& bench, std::span<const RootCell> cells,
                                const EvaluatorSettings& settings, std::uint64_t rays,
                                std::uint64_t seed) {
  const Scene& scene = *bench.scene;
  const VisibleSet everything = all_occludees(scene);
  std::vector<ObjectId> id_of(scene.object_count());  // by position in the source
  for (std::uint32_t i = 0; i < scene.object_count(); ++i)
    id_of[scene.object(ObjectId{i}).file_index] = ObjectId{i};
  Evaluator evaluator(bench.scene, settings);
  const RayOracle oracle(bench.source);
  EmbreeWitness caster(bench.source, oracle);

  Culling culling;
  double pvs_objects = 0, pvs_triangles = 0, seen_objects = 0, seen_triangles = 0;
  for (std::uint32_t i = 0; i < cells.size(); ++i) {
    VisibleSet pvs = everything;
    pvs.remove_all(evaluator.evaluate({i, 1}, cells[i].cell, everything).hidden);
    pvs_objects += pvs.count();
    pvs_triangles += static_cast<double>(triangles_in(scene, pvs));

    std::vector<std::uint32_t> targets;
    pvs.for_each([&](ObjectId id) { targets.push_back(scene.object(id).file_index); });
    Random random(seed * 0x9e3779b97f4a7c15ull + i);
    const WitnessReport looked = caster.sample(
        cells[i].cell,
        {.uniform_rays = rays / 2, .aimed_rays = rays - rays / 2, .targets = targets}, random);
    for (std::uint32_t position = 0; position < id_of.size(); ++position) {
      const ObjectId id = id_of[position];
      if (!looked.seen(position) || !everything.contains(id)) continue;
      ++seen_objects;
      seen_triangles += scene.object(id).triangle_count;
      culling.violations += !pvs.contains(id);
    }
  }
  const double count = static_cast<double>(cells.size());
  culling.visible_objects = pvs_objects / count;
  culling.culled_triangle_percent =
      100 - 100 * pvs_triangles / (count * static_cast<double>(triangles_in(scene, everything)));
  culling.pvs_over_seen_objects = pvs_objects / seen_objects;
  culling.pvs_over_seen_triangles = pvs_triangles / seen_triangles;
  return culling;
}

}  // namespace pvsfarm::bench

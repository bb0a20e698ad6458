#include "tests/bench/culling.hpp"

#include "tests/support/ray_oracle.hpp"
#include "tests/support/seen_by_rays.hpp"
#include "worker/evaluator/evaluator.hpp"

namespace pvsfarm::bench {

Result<Culling> measure_culling(const BenchScene& bench, std::span<const RootCell> cells,
                                const EvaluatorSettings& settings, std::uint64_t rays,
                                std::uint64_t seed) {
  const Scene& scene = *bench.scene;
  const VisibleSet everything = all_occludees(scene);
  Evaluator evaluator(bench.scene, settings);
  const RayCaster caster(bench.scene);
  const RayOracle oracle(bench.source);

  Culling culling;
  double pvs_objects = 0, pvs_triangles = 0, seen_objects = 0, seen_triangles = 0;
  for (std::uint32_t i = 0; i < cells.size(); ++i) {
    const Cell& cell = cells[i].cell;
    VisibleSet pvs = everything;
    pvs.remove_all(evaluator.evaluate({i, 1}, cell, everything).hidden);

    Random random(seed * 0x9e3779b97f4a7c15ull + i);
    const SeenByRays looked = caster.look(cell, pvs, rays, random);
    pvs_objects += pvs.count();
    pvs_triangles += static_cast<double>(triangles_in(scene, pvs));
    seen_objects += looked.seen.count();
    seen_triangles += static_cast<double>(triangles_in(scene, looked.seen));

    // An object that a ray saw and the PVS lacks counts if the ray holds in double too.
    const double margin = oracle.margin_for(cell.bounds());
    VisibleSet missing = looked.seen;
    missing.remove_all(pvs);
    missing.for_each([&](ObjectId id) {
      culling.violations +=
          oracle.clear_by(looked.witness[index_of(id)], margin, scene.object(id).file_index);
    });
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

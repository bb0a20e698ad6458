#include "coordinator/service/bake_identity.hpp"

#include <nlohmann/json.hpp>

#include "common/pvs/kernel.hpp"

namespace pvsfarm {

Digest bake_digest_of(const Digest& scene, const std::vector<RootCell>& roots,
                      const BakeSettings& settings) {
  DigestBuilder digest;
  digest.add("pvsfarm bake").add_u64(static_cast<std::uint64_t>(kAlgorithmVersion));
  digest.add(std::as_bytes(std::span(scene.bytes)));
  add_to_digest(digest, settings);
  digest.add_u64(roots.size());
  for (const RootCell& root : roots) {
    digest.add_u64(static_cast<std::uint64_t>(root.id));
    add_to_digest(digest, root.cell);
  }
  return digest.finish();
}

std::string settings_json(const BakeSettings& settings, const std::string& kernel) {
  const EvaluatorSettings& evaluator = settings.evaluator;
  nlohmann::ordered_json json{{"raster", to_string(evaluator.raster)},
                              {"resolution", evaluator.resolution_px},
                              {"planes", evaluator.planes_per_face},
                              {"extent", evaluator.extent},
                              {"near", evaluator.near_m},
                              {"budget", settings.subdivision.budget_triangles},
                              {"min_cell", settings.subdivision.min_cell_m}};
  if (!kernel.empty()) json["kernel"] = kernel;
  return json.dump();
}

}  // namespace pvsfarm

#include "coordinator/service/bake_identity.hpp"

#include <nlohmann/json.hpp>

#include "common/pvs/kernel.hpp"

namespace pvsfarm {

Digest bake_digest_of(const Digest& scene, const std::vector<RootCell>& roots,
                      const BakeSettings& settings) {
  DigestBuilder digest;
  digest.add("pvsfarm bake").add_u64(static_cast<std::uint64_t>(kAlgorithmVersion));
  digest.add(std::as_bytes(std::span(scene.bytes)));
  BakeSettings of_the_store = settings;
  of_the_store.evaluator.hint_viewpoints = 0;
  add_to_digest(digest, of_the_store);
  digest.add_u64(roots.size());
  for (const RootCell& root : roots) {
    digest.add_u64(static_cast<std::uint64_t>(root.id));
    add_to_digest(digest, root.cell);
  }
  return digest.finish();
}

std::string settings_json(const BakeSettings& settings, const std::string& kernel) {
  const EvaluatorSettings& evaluator = settings.evaluator;
  const SubdivisionSettings& subdivision = settings.subdivision;
  nlohmann::ordered_json methods = nlohmann::ordered_json::array();
  for (int m = 0; m < kMethodCount; ++m)
    if (evaluator.methods.has(static_cast<Method>(m)))
      methods.push_back(to_string(static_cast<Method>(m)));
  nlohmann::ordered_json json{{"raster", to_string(evaluator.raster)},
                              {"resolution", evaluator.resolution_px},
                              {"planes", evaluator.planes_per_face},
                              {"extent", evaluator.extent},
                              {"near", evaluator.near_m},
                              {"methods", methods},
                              {"gap", evaluator.gap},
                              {"max_rays", evaluator.max_rays},
                              {"time_ms", evaluator.time_ms},
                              {"item_buffer", evaluator.item_buffer_px},
                              {"effort_budget", evaluator.budget_triangles},
                              {"budget", subdivision.budget_triangles},
                              {"min_cell", subdivision.min_cell_m},
                              {"split_gain", subdivision.split_gain},
                              {"merge_tolerance", subdivision.merge_tolerance}};
  if (!kernel.empty()) json["kernel"] = kernel;
  return json.dump();
}

std::optional<BakeSettings> settings_from_json(const std::string& text) {
  BakeSettings settings;
  EvaluatorSettings& evaluator = settings.evaluator;
  SubdivisionSettings& subdivision = settings.subdivision;
  try {
    const auto json = nlohmann::json::parse(text);
    const auto& raster = json.at("raster");
    if (raster != to_string(RasterKind::kDirect) && raster != to_string(RasterKind::kOsmesa))
      return std::nullopt;
    evaluator.raster =
        raster == to_string(RasterKind::kOsmesa) ? RasterKind::kOsmesa : RasterKind::kDirect;
    json.at("resolution").get_to(evaluator.resolution_px);
    json.at("planes").get_to(evaluator.planes_per_face);
    json.at("extent").get_to(evaluator.extent);
    json.at("near").get_to(evaluator.near_m);
    std::uint32_t bits = 0;
    for (const auto& name : json.at("methods")) {
      const auto method = method_named(name.get<std::string>());
      if (!method) return std::nullopt;
      bits |= 1u << static_cast<unsigned>(*method);
    }
    evaluator.methods = Methods::from_bits(bits);
    json.at("gap").get_to(evaluator.gap);
    json.at("max_rays").get_to(evaluator.max_rays);
    json.at("time_ms").get_to(evaluator.time_ms);
    json.at("item_buffer").get_to(evaluator.item_buffer_px);
    json.at("effort_budget").get_to(evaluator.budget_triangles);
    json.at("budget").get_to(subdivision.budget_triangles);
    json.at("min_cell").get_to(subdivision.min_cell_m);
    json.at("split_gain").get_to(subdivision.split_gain);
    json.at("merge_tolerance").get_to(subdivision.merge_tolerance);
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
  return settings;
}

}  // namespace pvsfarm

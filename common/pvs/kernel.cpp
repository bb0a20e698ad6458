#include "common/pvs/kernel.hpp"

namespace pvsfarm {
namespace {
bool draws_with_mesa(const EvaluatorSettings& settings) {
  return settings.raster == RasterKind::kOsmesa || settings.methods.has(Method::kItemBuffers);
}
}  // namespace

Digest kernel_id(const Kernel& kernel, const EvaluatorSettings& settings, const Digest& scene) {
  DigestBuilder digest;
  digest.add("pvsfarm kernel").add_u64(static_cast<std::uint64_t>(kernel.algorithm_version));
  digest.add(draws_with_mesa(settings) ? std::string_view(kernel.mesa_version) : "");
  add_to_digest(digest, settings);
  return digest.add(std::as_bytes(std::span(scene.bytes))).finish();
}

std::string describe(const Kernel& kernel, const EvaluatorSettings& settings) {
  std::string text = "algorithm " + std::to_string(kernel.algorithm_version);
  if (draws_with_mesa(settings)) text += ", Mesa " + kernel.mesa_version;
  return text;
}

}  // namespace pvsfarm

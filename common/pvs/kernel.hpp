// The identity of the computation: workers whose kernel ids differ may give different bytes, and
// must not work on one bake.
#pragma once

#include <string>

#include "common/base/digest.hpp"
#include "common/pvs/settings.hpp"

namespace pvsfarm {

// Bumped with every change that can alter any result; part of the kernel id and of every store.
inline constexpr int kAlgorithmVersion = 6;

// What a worker's program brings to the results, beside settings and scene.
struct Kernel {
  int algorithm_version = kAlgorithmVersion;
  std::string mesa_version;  // of the OSMesa library it draws with; "" if it has none
  friend bool operator==(const Kernel&, const Kernel&) = default;
};

// Digest of kernel, settings and scene. The version of Mesa counts only where OSMesa draws.
Digest kernel_id(const Kernel& kernel, const EvaluatorSettings& settings, const Digest& scene);

// For people: "algorithm 1", "algorithm 1, Mesa 22.3.6".
std::string describe(const Kernel& kernel, const EvaluatorSettings& settings);

}  // namespace pvsfarm

// The occlusion sweep in bulk: random worlds through the real evaluator, alone and after the other
// provers, then rays that try to see what it calls hidden.
//
//   PVSFARM_SEED=S   only the world of this seed (a failure prints it)
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>

#include "tests/property/random_scenes.hpp"
#include "tests/support/aimed_rays.hpp"
#include "tests/support/evaluation.hpp"

namespace pvsfarm {
namespace {

constexpr std::uint64_t kWorlds = 15;
constexpr std::uint64_t kRaysPerHiddenObject = 200;

class SweptScenes : public testing::TestWithParam<Family> {};

TEST_P(SweptScenes, nothing_that_a_ray_reaches_is_hidden) {
  const char* only = std::getenv("PVSFARM_SEED");
  const std::uint64_t first = only == nullptr ? 1 : std::strtoull(only, nullptr, 10);
  const std::uint64_t last = only == nullptr ? kWorlds : first;
  std::uint64_t hidden_alone = 0, hidden_together = 0, rays = 0;
  for (std::uint64_t seed = first; seed <= last && !HasFailure(); ++seed) {
    const RandomWorld world = random_world(GetParam(), seed);
    const RayOracle oracle(world.source);
    const AimedRays aimed(world.source, oracle);
    EvaluatorSettings settings = provers_only(RasterKind::kDirect);
    settings.resolution_px = seed % 2 == 0 ? 64 : 128;
    EvaluatorSettings alone = settings, together = settings;
    alone.methods = {Method::kSweep};
    together.methods = {Method::kProjection, Method::kFineProjection, Method::kSweep};
    Evaluation by_sweep(world.source, alone), by_all(world.source, together);
    Random random(seed);
    for (const Cell& cell : world.cells) {
      const auto hidden = by_sweep.hidden_from(cell), all = by_all.hidden_from(cell);
      hidden_alone += hidden.size();
      hidden_together += all.size();
      for (const auto& set : {hidden, all}) {
        const auto report = aimed.search(cell, set, kRaysPerHiddenObject * set.size(), random);
        rays += report.rays;
        for (const Violation& violation : report.violations)
          ADD_FAILURE() << to_string(GetParam()) << ", PVSFARM_SEED=" << seed << ", "
                        << settings.resolution_px << " px: " << to_string(violation);
      }
    }
  }
  std::cout << to_string(GetParam()) << ": " << rays << " rays, " << hidden_alone
            << " objects hidden by the sweep alone, " << hidden_together << " together\n";
  if (only == nullptr) {
    EXPECT_GT(hidden_alone, 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(Families, SweptScenes, testing::ValuesIn(kFamilies),
                         [](const auto& test) { return std::string(to_string(test.param)); });

}  // namespace
}  // namespace pvsfarm

// Soundness in bulk: random worlds through the real evaluator, then rays that try to see what it
// calls hidden. 10^7 rays in all; not one may arrive.
//
//   PVSFARM_RAYS=N   N rays in all instead
//   PVSFARM_SEED=S   only the world of this seed (a failure prints it)
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>

#include "tests/property/random_scenes.hpp"
#include "tests/support/aimed_rays.hpp"
#include "tests/support/evaluation.hpp"

namespace pvsfarm {
namespace {

constexpr std::uint64_t kRaysInAll = 10'000'000;
constexpr std::uint64_t kRaysPerHiddenObject = 200;
constexpr std::uint64_t kCascadeRays = 2'000;
constexpr std::uint64_t kMostWorlds =
    3000;  // for a share of 10^7; who hides little must not loop forever
// OSMesa draws the same half-planes as the direct rasteriser, ten times as slowly: fewer worlds.
constexpr double kOsmesaShare = 0.1;
// Many small triangles, which every prover takes longer over.
constexpr double kFineMeshShare = 0.25;

std::uint64_t number_from_environment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

using Parameters = std::tuple<Family, RasterKind>;
class RandomScenes : public testing::TestWithParam<Parameters> {};

EvaluatorSettings random_settings(RasterKind raster, Random& random) {
  EvaluatorSettings settings = provers_only(raster);
  const int resolutions[] = {64, 128, 256};
  settings.resolution_px = resolutions[random.below(3)];
  settings.planes_per_face = 1 + static_cast<int>(random.below(8));
  settings.extent = random.between(0.3, 3);
  // What one prover hides, no other can be caught at: any of their combinations, surfaces,
  // slices and shafts often alone; the sweep, which takes longest, seldom.
  constexpr Method kProvers[] = {Method::kProjection, Method::kFineProjection, Method::kSurfaces,
                                 Method::kImproved,   Method::kSlices,         Method::kSweep,
                                 Method::kShafts};
  constexpr Method kAlone[] = {Method::kSurfaces, Method::kSlices, Method::kShafts,
                               Method::kShafts};
  const std::uint64_t alone = random.below(8);
  if (alone < std::size(kAlone)) {
    settings.methods = {kAlone[alone]};
    return settings;
  }
  std::uint32_t bits = 0;
  for (const Method method : kProvers)
    if (random.below(method == Method::kSweep ? 6 : 2) == 0) bits |= Methods{method}.bits();
  settings.methods = bits == 0 ? Methods{Method::kProjection} : Methods::from_bits(bits);
  return settings;
}

std::string names_of(Methods methods) {
  std::string names;
  for (int m = 0; m < kMethodCount; ++m)
    if (methods.has(static_cast<Method>(m)))
      names += std::string(" ") + to_string(static_cast<Method>(m));
  return names;
}

struct Tally {
  std::uint64_t worlds = 0, cells = 0, occludees = 0, hidden = 0, seen = 0, rays = 0;
};

void judge_world(Family family, RasterKind raster, std::uint64_t seed, Tally& tally) {
  const RandomWorld world = random_world(family, seed);
  Random random(seed ^ 0x5eed);
  const EvaluatorSettings settings = random_settings(raster, random);
  Evaluation evaluation(world.source, settings);
  const RayOracle oracle(world.source);
  const AimedRays rays(world.source, oracle);
  ++tally.worlds;
  EvaluatorSettings cascade = settings;
  cascade.methods = kDefaultMethods;
  cascade.max_rays = kCascadeRays;
  Evaluation with_witnesses(world.source, cascade);
  for (std::size_t c = 0; c < world.cells.size(); ++c) {
    const auto hidden = evaluation.hidden_from(world.cells[c]);
    const auto report =
        rays.search(world.cells[c], hidden, kRaysPerHiddenObject * hidden.size(), random);
    const CellDelta delta =
        with_witnesses.evaluator().evaluate(CellKey{static_cast<std::uint32_t>(c), 1},
                                            world.cells[c], all_occludees(with_witnesses.scene()));
    for (const std::uint32_t object : hidden)
      EXPECT_FALSE(delta.seen.contains(with_witnesses.id_of(object)))
          << to_string(family) << ", PVSFARM_SEED=" << seed << ", cell " << c << ", object "
          << object << ": the product's own witness refutes its certificate";
    EXPECT_EQ(delta.statistics.contradictions, 0u);
    tally.seen += delta.seen.count();
    ++tally.cells;
    tally.hidden += hidden.size();
    tally.occludees += all_occludees(evaluation.scene()).count();
    tally.rays += report.rays;
    for (const Violation& violation : report.violations)
      ADD_FAILURE() << to_string(family) << ", " << to_string(raster) << ", PVSFARM_SEED=" << seed
                    << ", cell " << c << ", " << settings.resolution_px << " px, "
                    << settings.planes_per_face << " planes, extent " << settings.extent << ","
                    << names_of(settings.methods) << ": " << to_string(violation);
  }
}

TEST_P(RandomScenes, nothing_that_a_ray_reaches_is_hidden) {
  const auto [family, raster] = GetParam();
  const bool fine = family == Family::kSolids || family == Family::kEarth;
  const double share = (raster == RasterKind::kOsmesa ? kOsmesaShare : 1 - kOsmesaShare) *
                       (fine ? kFineMeshShare : 1) / static_cast<double>(std::size(kFamilies));
  const std::uint64_t rays_in_all = number_from_environment("PVSFARM_RAYS", kRaysInAll);
  const auto budget = static_cast<std::uint64_t>(share * static_cast<double>(rays_in_all) + 1);
  Tally tally;
  const std::uint64_t only = number_from_environment("PVSFARM_SEED", 0);
  if (only != 0) {
    judge_world(family, raster, only, tally);
  } else {
    const std::uint64_t first = raster == RasterKind::kOsmesa ? 1'000'000 : 1;
    for (std::uint64_t seed = first; tally.rays < budget && !HasFailure(); ++seed) {
      ASSERT_LT(tally.worlds, kMostWorlds * (1 + rays_in_all / kRaysInAll))
          << "only " << tally.rays << " rays had a target";
      judge_world(family, raster, seed, tally);
    }
    // A verdict that hides little proves little.
    EXPECT_GE(tally.hidden * 20, tally.occludees);
  }
  std::cout << to_string(family) << ", " << to_string(raster) << ": " << tally.rays << " rays, "
            << tally.worlds << " worlds, " << tally.cells << " cells, " << tally.hidden << " of "
            << tally.occludees << " objects hidden, " << tally.seen << " seen\n";
}

std::string name_of(const testing::TestParamInfo<Parameters>& test) {
  return std::string(to_string(std::get<0>(test.param))) + "_" + to_string(std::get<1>(test.param));
}

INSTANTIATE_TEST_SUITE_P(Families, RandomScenes,
                         testing::Combine(testing::ValuesIn(kFamilies),
                                          testing::Values(RasterKind::kDirect,
                                                          RasterKind::kOsmesa)),
                         name_of);

}  // namespace
}  // namespace pvsfarm

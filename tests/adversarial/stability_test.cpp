// Perturbed scenes, judged by rays: whatever is done to a scene, nothing that a ray reaches is
// hidden; and where a perturbation leaves matter as good an occluder as it was, visible sets do not
// grow by much.
//
//   PVSFARM_FULL=1  more cells, seeds and rays, and all scenes with OSMesa
#include "tests/adversarial/stability.hpp"

#include <gtest/gtest.h>

#include <cctype>
#include <cstdlib>

#include "tests/adversarial/stability_scenes.hpp"
#include "tests/support/evaluation.hpp"

namespace pvsfarm {
namespace {

bool full() { return std::getenv("PVSFARM_FULL") != nullptr; }

struct Situation {
  Perturbation perturbation;
  RasterKind raster = RasterKind::kDirect;
};

// What GoogleTest prints of a parameter.
void PrintTo(const Situation& situation, std::ostream* out) {
  *out << to_string(situation.perturbation) << ", " << to_string(situation.raster);
}

// OSMesa draws the same half-planes as the direct rasteriser, ten times as slowly.
bool is_left_out(const StabilityScene& scene, RasterKind raster) {
  return raster == RasterKind::kOsmesa && !full() && scene.kind != SceneKind::kTiny;
}

void expect_growth_within(double most, const VisibleSets& base, const VisibleSets& sets) {
  if (most == kSameSets) {
    EXPECT_EQ(sets.visible, base.visible);
  } else {
    EXPECT_LE(static_cast<double>(sets.triangles), most * static_cast<double>(base.triangles));
  }
}

class Stability : public testing::TestWithParam<Situation> {};

TEST_P(Stability, hides_nothing_that_a_ray_reaches_and_no_less_than_it_must) {
  const auto& [perturbation, raster] = GetParam();
  const bool is_osmesa = raster == RasterKind::kOsmesa;
  const std::uint64_t seeds = full() && !is_osmesa ? 10 : 1;
  EvaluatorSettings settings = provers_only(raster);
  if (!full()) settings.methods = {Method::kProjection};
  const std::size_t cells = full() ? 6 : is_osmesa ? 1 : 2;
  for (const StabilityScene& scene : stability_scenes({.cells = cells, .rooms = full() ? 4 : 2})) {
    if (is_left_out(scene, raster)) continue;
    SCOPED_TRACE(scene.name);
    const VisibleSets base = evaluate(scene.world, scene.world, settings);
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      SCOPED_TRACE("seed " + std::to_string(seed));
      const Judgement judgement =
          judge(perturbation.apply(scene.world, seed), scene.world, settings,
                {.rays_per_hidden_object = full() ? 1000u : 30u,
                 .witness_rays = full() ? 100'000u : 1000u,
                 .seed = seed});
      EXPECT_GT(judgement.rays, 0u);
      for (const std::string& violation : judgement.violations) ADD_FAILURE() << violation;
      // Random worlds hold gaps of a billionth, which any rounding opens or closes.
      if (scene.kind != SceneKind::kRandom || perturbation.most_growth == kSameSets)
        expect_growth_within(perturbation.most_growth, base, judgement.sets);
    }
  }
}

// The scenes are worth perturbing: something is hidden in each, and something seen in most.
TEST(StabilityScenes, hide_something) {
  for (const StabilityScene& scene : stability_scenes({.cells = 2, .rooms = 2})) {
    const VisibleSets sets = evaluate(scene.world, scene.world, provers_only(RasterKind::kDirect));
    std::uint64_t all = 0;
    for (const SourceObject& object : scene.world.source.objects)
      all += object.occludee ? object.triangles.size() : 0;
    EXPECT_LT(sets.triangles, all * scene.world.cells.size()) << scene.name;
  }
}

std::vector<Situation> situations() {
  std::vector<Situation> all;
  for (const RasterKind raster : {RasterKind::kDirect, RasterKind::kOsmesa})
    for (const Perturbation& perturbation : all_perturbations())
      all.push_back({perturbation, raster});
  return all;
}

std::string name_of(const testing::TestParamInfo<Situation>& test) {
  std::string name = to_string(test.param.perturbation) + " " + to_string(test.param.raster);
  for (char& c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  return name;
}

INSTANTIATE_TEST_SUITE_P(Under, Stability, testing::ValuesIn(situations()), name_of);

}  // namespace
}  // namespace pvsfarm

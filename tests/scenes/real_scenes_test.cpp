// Soundness at full size: cells of real and generated scenes through the evaluator, then 10^5 rays
// a cell, all aimed at what it calls hidden. Not one may arrive.
//
//   PVSFARM_SCENES=FOLDER  where the real scenes are (default: ../shared/scenes beside the
//   checkout) PVSFARM_FULL=1         every cell, not a sample
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>

#include "tests/scenes/real_scenes.hpp"
#include "tests/support/aimed_rays.hpp"
#include "tests/support/embree_witness.hpp"
#include "tests/support/evaluation.hpp"

namespace pvsfarm {

// What GoogleTest prints of a scene.
void PrintTo(const NamedScene& scene, std::ostream* out) { *out << scene.name; }

namespace {

constexpr std::uint64_t kRaysPerCell = 100'000;
constexpr std::size_t kSampledCells = 32;
constexpr std::size_t kSampledCellsOsmesa = 4;
constexpr std::size_t kSampledCellsSurfaces = 2;
constexpr std::uint64_t kSeed = 20;

bool full() { return std::getenv("PVSFARM_FULL") != nullptr; }

// `count` cells of the scene, seeded; all of them, in order, for a full run.
std::vector<std::size_t> choose_cells(std::size_t cell_count, std::size_t count) {
  std::vector<std::size_t> chosen(cell_count);
  for (std::size_t i = 0; i < cell_count; ++i) chosen[i] = i;
  if (full() || cell_count <= count) return chosen;
  Random random(kSeed);
  for (std::size_t i = 0; i < count; ++i)
    std::swap(chosen[i], chosen[i + random.below(cell_count - i)]);
  chosen.resize(count);
  return chosen;
}

EvaluatorSettings planes_only(RasterKind raster) {
  EvaluatorSettings settings = provers_only(raster);
  settings.methods = {Method::kProjection, Method::kFineProjection, Method::kImproved};
  return settings;
}
EvaluatorSettings surfaces_only() {
  EvaluatorSettings settings = provers_only(RasterKind::kDirect);
  settings.methods = {Method::kSurfaces, Method::kShafts};
  return settings;
}

void judge(const NamedScene& named, const EvaluatorSettings& settings, std::size_t cell_count) {
  const auto loaded = load(named);
  ASSERT_TRUE(loaded.ok()) << loaded.error().text;
  const SceneWithCells& scene = loaded.value();
  Evaluation evaluation(scene.source, settings);
  const RayOracle oracle(scene.source);
  EmbreeWitness witness(scene.source, oracle);
  std::uint64_t rays = 0, hidden_in_all = 0;
  const auto chosen = choose_cells(scene.cells.size(), cell_count);
  for (const std::size_t c : chosen) {
    const Cell& cell = scene.cells[c];
    const auto hidden = evaluation.hidden_from(cell);
    Random random(kSeed + c);
    const WitnessReport report = witness.sample(
        cell, {.uniform_rays = 0, .aimed_rays = kRaysPerCell, .targets = hidden}, random);
    rays += report.rays;
    hidden_in_all += hidden.size();
    for (const std::uint32_t object : hidden)
      if (report.seen(object))
        ADD_FAILURE() << named.name << ", " << to_string(settings.raster) << ", cell " << c << ": "
                      << to_string(Violation{object, *report.witness[object]}) << " ("
                      << scene.source.objects[object].name << ")";
  }
  const std::uint64_t occludees = all_occludees(evaluation.scene()).count();
  std::cout << named.name << ", " << to_string(settings.raster) << ": " << chosen.size() << " of "
            << scene.cells.size() << " cells, " << rays << " rays, "
            << 100 * hidden_in_all / (occludees * chosen.size()) << " % of " << occludees
            << " objects hidden\n";
}

class GeneratedScenes : public testing::TestWithParam<NamedScene> {};
class ScenesOnDisk : public testing::TestWithParam<NamedScene> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ScenesOnDisk);

TEST_P(GeneratedScenes, no_ray_reaches_what_is_hidden) {
  judge(GetParam(), planes_only(RasterKind::kDirect), kSampledCells);
}
TEST_P(GeneratedScenes, no_ray_reaches_what_is_hidden_with_osmesa) {
  judge(GetParam(), planes_only(RasterKind::kOsmesa), kSampledCellsOsmesa);
}
TEST_P(GeneratedScenes, no_ray_reaches_what_surfaces_hide) {
  judge(GetParam(), surfaces_only(), kSampledCellsSurfaces);
}
TEST_P(ScenesOnDisk, no_ray_reaches_what_is_hidden) {
  judge(GetParam(), planes_only(RasterKind::kDirect), kSampledCells);
}
TEST_P(ScenesOnDisk, no_ray_reaches_what_is_hidden_with_osmesa) {
  judge(GetParam(), planes_only(RasterKind::kOsmesa), kSampledCellsOsmesa);
}
TEST_P(ScenesOnDisk, no_ray_reaches_what_surfaces_hide) {
  judge(GetParam(), surfaces_only(), kSampledCellsSurfaces);
}

TEST(WhereScenesAre, is_said) {
  if (scenes_on_disk().empty())
    std::cout << "no real scenes here (PVSFARM_SCENES or ../shared/scenes): the generated ones "
                 "alone were judged\n";
  for (const NamedScene& scene : scenes_on_disk()) std::cout << "real scene " << scene.name << '\n';
}

std::string name_of(const testing::TestParamInfo<NamedScene>& test) { return test.param.name; }
INSTANTIATE_TEST_SUITE_P(Scenes, GeneratedScenes, testing::ValuesIn(generated_scenes()), name_of);
INSTANTIATE_TEST_SUITE_P(Scenes, ScenesOnDisk, testing::ValuesIn(scenes_on_disk()), name_of);

}  // namespace
}  // namespace pvsfarm

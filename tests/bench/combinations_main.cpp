// bench_combinations: every combination of provers on and off, each after one or another choice of
// witnesses, on cells of every scene; then rays aimed at whatever any of them hid. One that arrives
// is a soundness bug. Prints a table in Markdown; exits with 1 where a ray arrived.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>

#include "common/scene/scene_build.hpp"
#include "coordinator/chart/sample.hpp"
#include "tests/scenes/real_scenes.hpp"
#include "tests/support/embree_witness.hpp"
#include "worker/evaluator/evaluator.hpp"

namespace pvsfarm::bench {
namespace {

struct Options {
  std::size_t cells = 3, surface_cells = 1;
  std::uint64_t rays = 100'000'000, seed = 1;
  std::vector<std::string> only;
};

constexpr Method kProvers[] = {Method::kProjection, Method::kFineProjection, Method::kSurfaces,
                               Method::kImproved,   Method::kSlices,         Method::kSweep,
                               Method::kShafts};
// Witnesses settle some objects before a prover meets them: another reading of the same cascade.
constexpr Methods kWitnesses[] = {
    {},
    {Method::kAimedRays},
    {Method::kLookAround},
    {Method::kLookAround, Method::kAimedRays, Method::kItemBuffers}};
constexpr std::uint64_t kWitnessRays = 4'000;  // few: much is left to be proved

std::vector<Methods> combinations(std::uint64_t seed) {
  Random random(seed);
  std::vector<Methods> all;
  for (std::uint32_t set = 1; set < 1u << std::size(kProvers); ++set) {
    std::uint32_t bits = kWitnesses[random.below(std::size(kWitnesses))].bits();
    for (std::size_t i = 0; i < std::size(kProvers); ++i)
      if ((set >> i & 1) != 0) bits |= Methods{kProvers[i]}.bits();
    all.push_back(Methods::from_bits(bits));
  }
  return all;
}

struct Tally {
  std::size_t combinations = 0, cells = 0, evaluations = 0;
  std::uint64_t rays = 0, hidden_by_any = 0, contradictions = 0, violations = 0;
  std::uint32_t objects = 0;
};

class Judge {
 public:
  Judge(SceneWithCells loaded, std::shared_ptr<const Scene> scene, const Options& options)
      : loaded_(std::move(loaded)),
        scene_(std::move(scene)),
        options_(options),
        everything_(all_occludees(*scene_)) {
    std::vector<RootCell> roots;
    for (const Cell& cell : loaded_.cells) roots.push_back({.cell = cell});
    cells_ = spread_sample(roots, options.cells, options.seed);
    visible_.assign(cells_.size(), everything_);
    tally_.cells = cells_.size();
    tally_.objects = everything_.count();
  }

  Tally run(std::uint64_t rays) {
    for (const Methods methods : combinations(options_.seed)) hide_with(methods);
    const RayOracle oracle(loaded_.source);
    EmbreeWitness caster(loaded_.source, oracle);
    const std::uint64_t rays_a_cell = rays / std::max<std::size_t>(cells_.size(), 1) + 1;
    for (std::size_t c = 0; c < cells_.size(); ++c) falsify(c, rays_a_cell, caster);
    return tally_;
  }

 private:
  void hide_with(Methods methods) {
    EvaluatorSettings settings;
    settings.methods = methods;
    settings.gap = 0;  // whatever is switched on has its turn
    settings.max_rays = kWitnessRays;
    Evaluator evaluator(scene_, settings);
    const std::size_t count = methods.has(Method::kSurfaces)
                                  ? std::min(options_.surface_cells, cells_.size())
                                  : cells_.size();
    ++tally_.combinations;
    for (std::size_t c = 0; c < count; ++c) {
      const auto root = static_cast<std::uint32_t>(cells_[c]);
      const CellDelta delta = evaluator.evaluate({root, 1}, loaded_.cells[root], everything_);
      visible_[c].remove_all(delta.hidden);
      tally_.contradictions += delta.statistics.contradictions;
      ++tally_.evaluations;
    }
  }

  void falsify(std::size_t c, std::uint64_t rays, EmbreeWitness& caster) {
    std::vector<std::uint32_t> targets;
    VisibleSet hidden = everything_;
    hidden.remove_all(visible_[c]);
    hidden.for_each([&](ObjectId id) { targets.push_back(scene_->object(id).file_index); });
    tally_.hidden_by_any += targets.size();
    Random random(options_.seed * 0x9e3779b97f4a7c15ull + cells_[c]);
    const Cell& cell = loaded_.cells[cells_[c]];
    const WitnessReport report =
        caster.sample(cell, {.uniform_rays = 0, .aimed_rays = rays, .targets = targets}, random);
    tally_.rays += report.rays;
    for (const std::uint32_t object : targets) {
      if (!report.seen(object)) continue;
      ++tally_.violations;
      std::fprintf(stderr, "violation: cell %u sees object %u\n",
                   cells_[c], object);
    }
  }

  SceneWithCells loaded_;
  std::shared_ptr<const Scene> scene_;
  const Options& options_;
  VisibleSet everything_;
  std::vector<std::uint32_t> cells_;
  std::vector<VisibleSet> visible_;  // of each cell, after every combination
  Tally tally_;
};

void print(const std::string& name, const Tally& t) {
  const double objects =
      static_cast<double>(t.objects) * static_cast<double>(std::max<std::size_t>(t.cells, 1));
  std::printf("| %s | %zu | %zu | %zu | %.1f | %.1f | %llu | %llu |\n", name.c_str(),
              t.combinations, t.cells, t.evaluations,
              100 * static_cast<double>(t.hidden_by_any) / std::max(objects, 1.0),
              static_cast<double>(t.rays) / 1e6, static_cast<unsigned long long>(t.contradictions),
              static_cast<unsigned long long>(t.violations));
  std::fflush(stdout);
}

Status run(const Options& options) {
  std::vector<NamedScene> scenes = generated_scenes();
  for (const NamedScene& scene : scenes_on_disk()) scenes.push_back(scene);
  if (!options.only.empty())
    std::erase_if(scenes, [&](const NamedScene& scene) {
      return std::find(options.only.begin(), options.only.end(), scene.name) == options.only.end();
    });
  if (scenes.empty()) return Error{ErrorKind::kCommandLine, "no scene of these names"};
  std::printf(
      "| scene | combinations | cells | evaluations | hidden by any, %% of objects | "
      "rays, millions | contradictions | wrong |\n|---|---:|---:|---:|---:|---:|---:|---:|\n");
  Tally all;
  for (const NamedScene& named : scenes) {
    auto loaded = load(named);
    if (!loaded.ok()) return loaded.error();
    auto scene = build_scene(loaded->source);
    if (!scene.ok()) return scene.error();
    Judge judge(std::move(*loaded), *scene, options);
    const Tally tally = judge.run(options.rays / scenes.size());
    print(named.name, tally);
    all.combinations = tally.combinations;
    all.cells += tally.cells;
    all.evaluations += tally.evaluations;
    all.rays += tally.rays;
    all.contradictions += tally.contradictions;
    all.violations += tally.violations;
  }
  std::printf("| all | %zu | %zu | %zu | | %.1f | %llu | %llu |\n", all.combinations, all.cells,
              all.evaluations, static_cast<double>(all.rays) / 1e6,
              static_cast<unsigned long long>(all.contradictions),
              static_cast<unsigned long long>(all.violations));
  if (all.violations + all.contradictions > 0)
    return runtime_error("something that is declared hidden is seen");
  return {};
}

}  // namespace
}  // namespace pvsfarm::bench

int main(int argc, char** argv) {
  using namespace pvsfarm;
  using namespace pvsfarm::bench;
  Options options;
  CLI::App app{"Rays at what any combination of provers hides, on every scene"};
  app.add_option("--cells", options.cells, "of a scene, spread over it");
  app.add_option("--surface-cells", options.surface_cells,
                 "of them, for combinations with surfaces");
  app.add_option("--rays", options.rays, "over all scenes");
  app.add_option("--seed", options.seed, "of the sample, the witnesses and the rays");
  app.add_option("--only", options.only, "scenes by name; none: all")->delimiter(',');
  CLI11_PARSE(app, argc, argv);
  const Status status = run(options);
  if (status.ok()) return 0;
  std::fprintf(stderr, "bench_combinations: %s\n", status.error().text.c_str());
  return static_cast<int>(status.error().kind);
}

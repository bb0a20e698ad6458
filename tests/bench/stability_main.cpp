// bench_stability: how far visible sets grow when scenes are perturbed, as JSON, one object a line:
//   {"scene", "perturbation", "amount", "cells", "pvs_triangles", "base_pvs_triangles", "growth",
//    "pvs_over_seen", "violations", "rays"}
// Triangles are those of the unperturbed scene, summed over the cells; "amount" is 0 where a
// perturbation has none; ratios are null where the divisor is 0. The rows of perturbation "none"
// are the unperturbed scenes. Everything is seeded. Exits with 3 if a ray saw an object declared
// hidden.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/adversarial/stability.hpp"
#include "tests/adversarial/stability_scenes.hpp"
#include "tests/support/evaluation.hpp"

namespace pvsfarm {
namespace {

constexpr int kWrongAnswer = 3;

struct Options {
  StabilitySize size{.cells = 6, .rooms = 5};
  std::uint64_t seeds = 3;
  Attack attack{.rays_per_hidden_object = 200, .witness_rays = 400'000};
  EvaluatorSettings evaluator = provers_only(RasterKind::kDirect);
  std::string scene, perturbation;
};

struct Row {
  const StabilityScene& scene;
  std::string perturbation;
  double amount = 0;
  const Judgement& judgement;
  std::uint64_t base_triangles = 0;
};

nlohmann::ordered_json ratio(std::uint64_t a, std::uint64_t b) {
  if (b == 0) return nullptr;
  return static_cast<double>(a) / static_cast<double>(b);
}

void print(const Row& row) {
  const Judgement& j = row.judgement;
  nlohmann::ordered_json line;
  line["scene"] = row.scene.name;
  line["perturbation"] = row.perturbation;
  line["amount"] = row.amount;
  line["cells"] = j.sets.visible.size();
  line["pvs_triangles"] = j.sets.triangles;
  line["base_pvs_triangles"] = row.base_triangles;
  line["growth"] = ratio(j.sets.triangles, row.base_triangles);
  line["pvs_over_seen"] = ratio(j.sets.triangles, j.seen_triangles);
  line["violations"] = j.violations.size();
  line["rays"] = j.rays;
  std::printf("%s\n", line.dump().c_str());
  std::fflush(stdout);
  for (const std::string& text : j.violations)
    std::fprintf(stderr, "bench_stability: %s, %s %g: %s\n", row.scene.name.c_str(),
                 row.perturbation.c_str(), row.amount, text.c_str());
}

void add_to(Judgement& sum, Judgement part) {
  sum.sets.triangles += part.sets.triangles;
  sum.seen_triangles += part.seen_triangles;
  sum.rays += part.rays;
  const auto append = [](auto& to, auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  append(sum.sets.visible, part.sets.visible);
  append(sum.violations, part.violations);
}

std::uint64_t run(const Options& options) {
  std::uint64_t violations = 0;
  for (const StabilityScene& scene : stability_scenes(options.size)) {
    if (!options.scene.empty() && options.scene != scene.name) continue;
    const Judgement base = judge(scene.world, scene.world, options.evaluator, options.attack);
    print({scene, "none", 0, base, base.sets.triangles});
    violations += base.violations.size();
    for (const Perturbation& p : all_perturbations()) {
      if (!options.perturbation.empty() && options.perturbation != p.name) continue;
      Judgement sum;
      for (std::uint64_t seed = 1; seed <= options.seeds; ++seed)
        add_to(sum,
               judge(p.apply(scene.world, seed), scene.world, options.evaluator, options.attack));
      print({scene, p.name, p.amount, sum, base.sets.triangles * options.seeds});
      violations += sum.violations.size();
    }
  }
  return violations;
}

}  // namespace
}  // namespace pvsfarm

int main(int argc, char** argv) {
  using namespace pvsfarm;
  Options options;
  CLI::App app{"How far visible sets grow when scenes are perturbed: JSON, one object a line"};
  app.add_option("--cells", options.size.cells, "a scene");
  app.add_option("--rooms", options.size.rooms, "a side of the scene of rooms");
  app.add_option("--seeds", options.seeds, "random variants of each perturbation");
  app.add_option("--rays", options.attack.witness_rays, "a cell, against everything");
  app.add_option("--aimed", options.attack.rays_per_hidden_object, "rays at each hidden object");
  app.add_option("--scene", options.scene, "only this one");
  app.add_option("--perturbation", options.perturbation, "only this one, all amounts");
  const std::map<std::string, RasterKind> rasters{{"direct", RasterKind::kDirect},
                                                  {"osmesa", RasterKind::kOsmesa}};
  app.add_option("--raster", options.evaluator.raster, "direct or osmesa")
      ->transform(CLI::CheckedTransformer(rasters));
  CLI11_PARSE(app, argc, argv);
  return run(options) == 0 ? 0 : kWrongAnswer;
}

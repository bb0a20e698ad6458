// bench_reference: the PVS of a real scene against the one another tool made (reference.json beside
// the scene: cell id -> objects by their position in the file), cell by cell. Also the certified
// gap, processor time, and objects that a ray sees though they are declared hidden.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "common/scene/scene_build.hpp"
#include "coordinator/chart/sample.hpp"
#include "tests/bench/sampling.hpp"
#include "tests/scenes/real_scenes.hpp"
#include "tests/support/aimed_rays.hpp"
#include "tests/support/embree_witness.hpp"
#include "worker/evaluator/evaluator.hpp"

namespace pvsfarm::bench {
namespace {

struct Options {
  std::string folder;
  std::size_t cells = 60;
  std::uint64_t rays = 0, looks = 0, seed = 1;
  std::vector<std::string> methods;
  bool each = false, by_method = false;
  int of = -1;
  EvaluatorSettings evaluator;
};

struct Reference {
  std::vector<std::set<std::uint32_t>> visible;  // by cell in file order; empty: none known
};

Reference read_reference(const std::string& folder, std::size_t cells) {
  Reference reference;
  reference.visible.resize(cells);
  std::ifstream known(folder + "/reference.json"), file(folder + "/cells.json");
  if (!known) return reference;
  const auto visible = nlohmann::json::parse(known)["visible"];
  const auto list = nlohmann::json::parse(file)["cells"];
  for (std::size_t i = 0; i < cells; ++i) {
    const auto found = visible.find(list[i]["id"].dump());
    if (found == visible.end()) continue;
    for (const auto& object : *found) reference.visible[i].insert(object.get<std::uint32_t>());
  }
  return reference;
}

struct Sums {
  double pvs = 0, known = 0, ratio = 0, gap = 0, seen = 0;
  double pvs_triangles = 0, seen_triangles = 0, worst = 0, missed = 0;
  std::size_t cells = 0, compared = 0, above = 0;
  std::uint64_t violations = 0, touched = 0;
};

double cpu_ms() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

class Bench {
 public:
  Bench(const Options& options, SceneWithCells loaded, std::shared_ptr<const Scene> scene)
      : options_(options),
        loaded_(std::move(loaded)),
        scene_(std::move(scene)),
        everything_(all_occludees(*scene_)),
        reference_(read_reference(options.folder, loaded_.cells.size())),
        evaluator_(scene_, options.evaluator, cpu_ms),
        oracle_(loaded_.source),
        caster_(loaded_.source, oracle_) {}

  void judge(std::uint32_t index) {
    const Cell& cell = loaded_.cells[index];
    const CellDelta delta = evaluator_.evaluate({index, 1}, cell, everything_);
    VisibleSet pvs = everything_;
    pvs.remove_all(delta.hidden);
    std::set<std::uint32_t> positions;
    pvs.for_each([&](ObjectId id) { positions.insert(scene_->object(id).file_index); });
    const auto& known = reference_.visible[index];
    const double triangles = static_cast<double>(triangles_in(*scene_, pvs));
    const double seen = static_cast<double>(triangles_in(*scene_, delta.seen));
    ++sums_.cells;
    sums_.pvs += pvs.count();
    sums_.seen += delta.seen.count();
    sums_.pvs_triangles += triangles;
    sums_.seen_triangles += seen;
    sums_.gap += triangles > 0 ? 1 - seen / triangles : 0;
    for (int m = 0; m < kMethodCount; ++m) {
      methods_[m].hidden_objects += delta.statistics.methods[m].hidden_objects;
      methods_[m].seen_objects += delta.statistics.methods[m].seen_objects;
      methods_[m].work += delta.statistics.methods[m].work;
      methods_[m].cpu_ms += delta.statistics.methods[m].cpu_ms;
    }
    double ratio = 0;
    if (!known.empty()) {
      ratio = static_cast<double>(positions.size()) / static_cast<double>(known.size());
      ++sums_.compared;
      sums_.known += static_cast<double>(known.size());
      sums_.ratio += ratio;
      sums_.worst = std::max(sums_.worst, ratio);
      sums_.above += ratio > 1.5;
      for (const std::uint32_t object : known) sums_.missed += !positions.contains(object);
    }
    if (options_.each)
      std::printf("cell %u: PVS %zu, reference %zu (%.2f), seen %u\n", index, positions.size(),
                  known.size(), ratio, delta.seen.count());
    if (options_.of == static_cast<int>(index)) {
      for (const std::uint32_t object : positions)
        if (!known.contains(object)) std::printf("  not in the reference: %u\n", object);
    }
    falsify(index, pvs);
    look_at(index, pvs);
  }

  void report() const {
    const double n = static_cast<double>(std::max<std::size_t>(sums_.cells, 1));
    const double compared = static_cast<double>(std::max<std::size_t>(sums_.compared, 1));
    std::printf(
        "%zu cells: PVS %.1f, seen %.1f objects; gap %.3f in all, %.3f mean; "
        "%llu violations\n",
        sums_.cells, sums_.pvs / n, sums_.seen / n, 1 - sums_.seen_triangles / sums_.pvs_triangles,
        sums_.gap / n, static_cast<unsigned long long>(sums_.violations));
    if (options_.looks > 0)
      std::printf("met by rays: %.1f objects\n", static_cast<double>(sums_.touched) / n);
    if (sums_.compared > 0)
      std::printf(
          "reference %.1f: %.2f times in all, mean %.2f, worst %.2f; %zu of %zu above 1.5; "
          "%.1f of the reference not in the PVS\n",
          sums_.known / compared, sums_.pvs / sums_.known, sums_.ratio / compared, sums_.worst,
          sums_.above, sums_.compared, sums_.missed / compared);
    for (int m = 0; m < kMethodCount; ++m)
      if (methods_[m].work > 0)
        std::printf("  %-16s hidden %7.1f  seen %6.1f  work %9.0f  %7.2f ms\n",
                    to_string(static_cast<Method>(m)), methods_[m].hidden_objects / n,
                    methods_[m].seen_objects / n, static_cast<double>(methods_[m].work) / n,
                    methods_[m].cpu_ms / n);
  }
  bool sound() const { return sums_.violations == 0; }
  std::vector<std::uint32_t> sample() const {
    std::vector<RootCell> roots;
    for (const Cell& cell : loaded_.cells) roots.push_back({.cell = cell});
    std::vector<std::uint32_t> indices;
    for (const auto i : spread_sample(roots, options_.cells, options_.seed)) indices.push_back(i);
    return indices;
  }

 private:
  void falsify(std::uint32_t index, const VisibleSet& pvs) {
    if (options_.rays == 0) return;
    std::vector<std::uint32_t> hidden;
    VisibleSet rest = everything_;
    rest.remove_all(pvs);
    rest.for_each([&](ObjectId id) { hidden.push_back(scene_->object(id).file_index); });
    Random random(options_.seed * 0x9e3779b97f4a7c15ull + index);
    const auto looked = caster_.sample(loaded_.cells[index],
                                       {.uniform_rays = options_.rays / 2,
                                        .aimed_rays = options_.rays - options_.rays / 2,
                                        .targets = hidden},
                                       random);
    for (const std::uint32_t object : hidden) {
      if (!looked.seen(object)) continue;
      ++sums_.violations;
      std::printf("violation: cell %u sees object %u\n", index, object);
    }
  }

  // How many objects of the PVS are met by a ray that was blocked by nothing before: no proof of
  // sight where matter coincides, as walls of a game do with what blocks for them.
  void look_at(std::uint32_t index, const VisibleSet& pvs) {
    constexpr double kEnd = 1 - 1e-5;
    if (options_.looks == 0) return;
    Random random(options_.seed * 0x9e3779b97f4a7c15ull + index);
    std::uint32_t touched = 0;
    pvs.for_each([&](ObjectId id) {
      const std::uint32_t position = scene_->object(id).file_index;
      for (std::uint64_t k = 0; k < options_.looks; ++k) {
        const Segment line{sample_cell(loaded_.cells[index], random),
                           sample_surface(loaded_.source.objects[position], random)};
        const auto hit = oracle_.first_hit(line);
        if (hit && hit->t < kEnd) continue;
        ++touched;
        return;
      }
      if (options_.of >= 0) std::printf("  open, met by no ray: %u\n", position);
    });
    sums_.touched += touched;
    if (options_.each) std::printf("  met by rays: %u\n", touched);
  }

  const Options& options_;
  SceneWithCells loaded_;
  std::shared_ptr<const Scene> scene_;
  VisibleSet everything_;
  Reference reference_;
  Evaluator evaluator_;
  RayOracle oracle_;
  EmbreeWitness caster_;
  Sums sums_;
  StatisticsByMethod methods_;
};

Status run(Options options) {
  if (!options.methods.empty()) {
    options.evaluator.methods = {};
    std::uint32_t bits = 0;
    for (const std::string& name : options.methods) {
      const auto method = method_named(name);
      if (!method) return Error{ErrorKind::kCommandLine, "no method is called " + name};
      bits |= 1u << static_cast<unsigned>(*method);
    }
    options.evaluator.methods = Methods::from_bits(bits);
  }
  auto loaded = load({"scene", options.folder});
  if (!loaded.ok()) return loaded.error();
  auto scene = build_scene(loaded->source);
  if (!scene.ok()) return scene.error();
  std::printf("%zu surfaces, %zu triangles of them\n", (*scene)->surface_components().size(),
              (*scene)->surface_triangles().size());
  Bench bench(options, std::move(*loaded), *scene);
  if (options.of >= 0) {
    bench.judge(static_cast<std::uint32_t>(options.of));
  } else {
    for (const std::uint32_t index : bench.sample()) bench.judge(index);
  }
  bench.report();
  if (!bench.sound()) return runtime_error("a ray saw an object declared hidden");
  return {};
}

}  // namespace
}  // namespace pvsfarm::bench

int main(int argc, char** argv) {
  using namespace pvsfarm;
  using namespace pvsfarm::bench;
  Options options;
  CLI::App app{"The PVS of a real scene against a reference, cell by cell"};
  app.add_option("folder", options.folder, "scene.obj, cells.json, tags.json, reference.json ...")
      ->required();
  app.add_option("--cells", options.cells, "how many, spread over the scene");
  app.add_option("--cell", options.of, "this one alone, and what its PVS has too much");
  app.add_option("--rays", options.rays, "a cell, to falsify; 0: none");
  app.add_option("--looks", options.looks,
                 "rays at most at each object of a PVS, to see which are met; 0: none");
  app.add_option("--seed", options.seed, "of the sample and the rays");
  app.add_option("--methods", options.methods, "by name; none: the default")->delimiter(',');
  app.add_option("--gap", options.evaluator.gap, "where a cell's evaluation ends");
  app.add_option("--max-rays", options.evaluator.max_rays, "of the witnesses, a cell");
  app.add_option("--planes", options.evaluator.planes_per_face, "a face");
  app.add_option("--resolution", options.evaluator.resolution_px, "pixels a side of a map");
  app.add_flag("--each", options.each, "a line a cell");
  CLI11_PARSE(app, argc, argv);
  const Status status = run(options);
  if (status.ok()) return 0;
  std::fprintf(stderr, "bench_reference: %s\n", status.error().text.c_str());
  return static_cast<int>(status.error().kind);
}

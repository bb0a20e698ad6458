// bench_accuracy: the measurements of docs/accuracy.md, one table row a call, so that a script can
// lay them out (docs/make_accuracy.sh). Everything is seeded; processor time, not wall time, unless
// it says otherwise.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>

#include "coordinator/generate/write_scene.hpp"
#include "tests/bench/bench_scene.hpp"
#include "tests/bench/culling.hpp"
#include "tests/bench/evaluation_speed.hpp"
#include "tests/bench/farm_speed.hpp"
#include "tests/bench/method_costs.hpp"
#include "tests/bench/profile.hpp"
#include "tests/bench/sampling.hpp"
#include "tests/support/fault_figures.hpp"

namespace pvsfarm::bench {
namespace {

struct Options {
  std::string generator = "city";
  int size = 0;
  double cell_size_m = 5;
  std::size_t cells = 60;
  std::uint64_t rays = 4'000'000;
  std::uint64_t seed = 1;
  std::vector<std::uint64_t> budgets{5'000, 10'000, 20'000, 40'000, 80'000};
  EvaluatorSettings evaluator;
  std::vector<std::string> methods;
  std::string bin_folder, work_folder;
  int runs = 3;
  bool must_hold = false;
};

Status print_culling(const Options& options) {
  const auto scene = make_bench_scene(options.generator, options.size, options.cell_size_m);
  if (!scene.ok()) return scene.error();
  const std::vector<RootCell> cells = sample_cells(scene->cells, options.cells, options.seed);
  const auto culling =
      measure_culling(*scene, cells, options.evaluator, options.rays, options.seed);
  if (!culling.ok()) return culling.error();
  std::printf("| %s | %g | %zu of %zu | %.1f | %.1f | %.2f | %.2f | %llu |\n",
              options.generator.c_str(), options.cell_size_m, cells.size(), scene->cells.size(),
              culling->visible_objects, culling->culled_triangle_percent,
              culling->pvs_over_seen_objects, culling->pvs_over_seen_triangles,
              static_cast<unsigned long long>(culling->violations));
  if (culling->violations > 0) return runtime_error("a ray saw an object declared hidden");
  return {};
}

Status print_speed(const Options& options) {
  const auto scene = make_bench_scene(options.generator, options.size, options.cell_size_m);
  if (!scene.ok()) return scene.error();
  const std::vector<RootCell> cells = sample_cells(scene->cells, options.cells, options.seed);
  const auto speed = measure_evaluation(scene->scene, cells, options.evaluator);
  if (!speed.ok()) return speed.error();
  std::printf("| %s | %d | %.1f | %.1f | %.1f | `%.12s` |\n", to_string(options.evaluator.raster),
              options.evaluator.resolution_px, speed->mean_ms(), speed->quantile_ms(0.5),
              speed->quantile_ms(1), speed->results.hex().c_str());
  return {};
}

Status print_sampling(const Options& options) {
  const auto scene = make_bench_scene(options.generator, options.size, options.cell_size_m);
  if (!scene.ok()) return scene.error();
  const std::vector<RootCell> cells = sample_cells(scene->cells, options.cells, options.seed);
  const auto sampling = measure_sampling(*scene, cells,
                                         {.evaluator = options.evaluator,
                                          .rays = options.budgets,
                                          .reference_rays = options.rays,
                                          .seed = options.seed});
  if (!sampling.ok()) return sampling.error();
  std::printf("%s: %.1f targets, %.1f seen by the reference, sampler made in %.0f ms\n",
              options.generator.c_str(), sampling->targets, sampling->reference_objects,
              sampling->construction_ms);
  for (const SamplingRow& row : sampling->rows)
    std::printf("| %.0f | %.0f | %.2f | %.2f | %.1f | %.2f |\n", row.rays, row.checks,
                row.found_objects_percent, row.found_triangles_percent, row.beyond_objects,
                row.cpu_ms);
  return {};
}

// The settings asked for, with the methods named if any are.
Result<EvaluatorSettings> settings_of(const Options& options) {
  EvaluatorSettings settings = options.evaluator;
  if (!options.methods.empty()) settings.methods = {};
  for (const std::string& name : options.methods) {
    const auto method = method_named(name);
    if (!method) return invalid_input("no method is named " + name);
    settings.methods = Methods::from_bits(settings.methods.bits() | Methods{*method}.bits());
  }
  return settings;
}

// A row a step, a row for all, and what they are measured against.
Status print_profile(const Options& options) {
  const auto scene = make_bench_scene(options.generator, options.size, options.cell_size_m);
  if (!scene.ok()) return scene.error();
  const std::vector<RootCell> cells = sample_cells(scene->cells, options.cells, options.seed);
  const auto settings = settings_of(options);
  if (!settings.ok()) return settings.error();
  const auto profile = measure_profile(scene->scene, cells, *settings);
  if (!profile.ok()) return profile.error();
  StageWork all;
  double all_floor_ms = 0;
  for (std::size_t s = 0; s < kStageCount; ++s) {
    const StageWork& work = profile->stages[s];
    const auto stage = static_cast<Stage>(s);
    const double least_ms = floor_ms(stage, work, profile->machine);
    all.cpu_ms += work.cpu_ms;
    all.bytes += work.bytes;
    all_floor_ms += least_ms;
    std::printf("| %s | %.3f | %llu %s | %.2f | %.3f |\n", to_string(stage), work.cpu_ms,
                static_cast<unsigned long long>(work.operations), operation_of(stage),
                static_cast<double>(work.bytes) * 1e-6, least_ms);
  }
  std::printf("| all | %.3f | | %.2f | %.3f |\n", all.cpu_ms, static_cast<double>(all.bytes) * 1e-6,
              all_floor_ms);
  std::printf(
      "\nNobody being told where it goes, a cell took %.2f ms. The machine at its best: "
      "%.1f GB/s of map in the cache, %.2f operations of doubles a nanosecond.\n",
      profile->cpu_ms, profile->machine.bytes_per_ms * 1e-6,
      profile->machine.operations_per_ms * 1e-6);
  return {};
}

// A row a method, and one for all; of a cell.
Status print_methods(const Options& options) {
  const auto scene = make_bench_scene(options.generator, options.size, options.cell_size_m);
  if (!scene.ok()) return scene.error();
  const std::vector<RootCell> cells = sample_cells(scene->cells, options.cells, options.seed);
  const auto settings = settings_of(options);
  if (!settings.ok()) return settings.error();
  const MethodCosts costs = measure_methods(scene->scene, cells, *settings);
  const auto count = static_cast<double>(cells.size());
  for (int m = 0; m < kMethodCount; ++m) {
    const MethodStatistics& own = costs.methods[m];
    if (own.work == 0) continue;
    std::printf("| %s | %.0f | %.0f | %.0f | %.2f | %.6f |\n", to_string(static_cast<Method>(m)),
                static_cast<double>(own.hidden_triangles) / count,
                static_cast<double>(own.seen_triangles) / count,
                static_cast<double>(own.work) / count, own.cpu_ms / count,
                own.cpu_ms / static_cast<double>(own.work));
  }
  const auto pvs = static_cast<double>(costs.pvs_triangles);
  std::printf(
      "| all: PVS %.0f, gap %.4f, culled %.2f %%; %.1f planes, %.0f pieces, %.0f tests; hidden "
      "`%.12s`, seen `%.12s` | | | | %.2f | |\n",
      pvs / count, 1 - static_cast<double>(costs.seen_triangles) / pvs,
      100 - 100 * pvs / static_cast<double>(costs.all_triangles), costs.work.planes / count,
      costs.work.projections / count, costs.work.box_tests / count, costs.hidden.hex().c_str(),
      costs.seen.hex().c_str(), costs.cpu_ms / count);
  return {};
}

void keep_least(FarmRun& kept, const FarmRun& run) {
  if (kept.store_hash.empty()) kept = run;
  kept.wall_ms = std::min(kept.wall_ms, run.wall_ms);
  kept.coordinator_cpu_ms = std::min(kept.coordinator_cpu_ms, run.coordinator_cpu_ms);
  kept.worker_cpu_ms = std::min(kept.worker_cpu_ms, run.worker_cpu_ms);
}

// What a farm must reach; for the page of docs/make_reliability.sh, and as the exit code.
Status judge_farm(const Options& options, double times, double coordinator_ms) {
  constexpr double kLeastTimes = 1.9, kMostCoordinatorMs = 0.2;
  const auto rounded = [](double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2f", value);
    return std::string(text);
  };
  const std::string cells = std::to_string(options.cells) + " cells, the least of " +
                            std::to_string(options.runs) + " runs each";
  const bool fast = times >= kLeastTimes, light = coordinator_ms <= kMostCoordinatorMs;
  record({.row = 29,
          .what = "two workers, times as fast as one, the same bytes, " + cells,
          .asked = "1.9",
          .reached = rounded(times),
          .held = fast});
  record({.row = 29,
          .what = "the coordinator's processor time a cell, two workers, " + cells,
          .asked = "0.2 ms",
          .reached = rounded(coordinator_ms) + " ms",
          .held = light});
  if (!options.must_hold || (fast && light)) return {};
  return runtime_error("missed: " + rounded(times) + " times as fast, " + rounded(coordinator_ms) +
                       " ms of the coordinator a cell");
}

// One and two workers in turn, `runs` times; of each figure the least, since disturbances only add.
// What starting up and writing the store take is measured by baking kFewCells, and taken off.
Status print_farm(const Options& options) {
  constexpr std::size_t kFewCells = 8;
  std::filesystem::create_directories(options.work_folder);
  auto scene = make_bench_scene(options.generator, options.size, options.cell_size_m);
  if (!scene.ok()) return scene.error();
  const std::size_t counts[] = {kFewCells, options.cells};
  const std::string names[] = {"/few", "/many"};
  for (int part = 0; part < 2; ++part) {
    const auto cells = sample_cells(scene->cells, counts[part], options.seed);
    const Status written =
        write_scene({scene->source, cells}, options.work_folder + names[part] + ".obj");
    if (!written.ok()) return written;
  }
  FarmRun best[2][2];  // few or many cells; one worker or two
  for (int i = 0; i < options.runs; ++i) {
    for (const int part : {0, 1}) {
      for (const int workers : {1, 2}) {
        const auto run = run_farm({.bin_folder = options.bin_folder,
                                   .work_folder = options.work_folder,
                                   .scene_path = options.work_folder + names[part],
                                   .workers = workers});
        if (!run.ok()) return run.error();
        FarmRun& kept = best[part][workers - 1];
        const std::string& expected = best[part][0].store_hash;
        if (!expected.empty() && expected != run->store_hash)
          return runtime_error("two bakes of the same scene wrote different bytes");
        keep_least(kept, *run);
      }
    }
  }
  const double count = static_cast<double>(options.cells - kFewCells);
  const auto baking_ms = [&](int w) { return best[1][w].wall_ms - best[0][w].wall_ms; };
  for (const int w : {0, 1}) {
    std::printf("| %d | %zu | %.1f | %.1f | %.2f | %.2f | %.3f | `%.12s` |\n", w + 1, options.cells,
                best[0][w].wall_ms * 1e-3, baking_ms(w) * 1e-3, baking_ms(0) / baking_ms(w),
                (best[1][w].worker_cpu_ms - best[0][w].worker_cpu_ms) / count,
                (best[1][w].coordinator_cpu_ms - best[0][w].coordinator_cpu_ms) / count,
                best[1][w].store_hash.c_str());
  }
  const double coordinator_ms = best[1][1].coordinator_cpu_ms - best[0][1].coordinator_cpu_ms;
  return judge_farm(options, baking_ms(0) / baking_ms(1), coordinator_ms / count);
}

void add_scene_options(CLI::App& command, Options& options) {
  command.add_option("--generator", options.generator, "city, closed-city, forest, rooms ...");
  command.add_option("--size", options.size, "blocks, trees, rooms or tiles; 0: the default");
  command.add_option("--cell-size", options.cell_size_m, "metres");
  command.add_option("--cells", options.cells, "how many cells, spread over the scene");
  command.add_option("--seed", options.seed, "of the sample and the rays");
  const std::map<std::string, RasterKind> rasters{{"direct", RasterKind::kDirect},
                                                  {"osmesa", RasterKind::kOsmesa}};
  command.add_option("--raster", options.evaluator.raster, "direct or osmesa")
      ->transform(CLI::CheckedTransformer(rasters));
  command.add_option("--resolution", options.evaluator.resolution_px, "pixels a side of a map");
}

void add_method_options(CLI::App& command, Options& options) {
  command.add_option("--methods", options.methods, "instead of a bake's")->delimiter(',');
  command.add_option("--gap", options.evaluator.gap, "that is asked for");
  command.add_option("--planes", options.evaluator.planes_per_face, "a face of the cell");
}

}  // namespace
}  // namespace pvsfarm::bench

int main(int argc, char** argv) {
  using namespace pvsfarm;
  using namespace pvsfarm::bench;
  Options options;
  Status (*run)(const Options&) = nullptr;
  CLI::App app{"Measurements of docs/accuracy.md, one table row a call"};
  app.require_subcommand(1);

  CLI::App* culling = app.add_subcommand("culling", "what is culled, against rays");
  add_scene_options(*culling, options);
  culling->add_option("--rays", options.rays, "a cell");
  culling->callback([&] { run = print_culling; });

  CLI::App* speed = app.add_subcommand("speed", "processor time of evaluating a cell");
  add_scene_options(*speed, options);
  speed->callback([&] { run = print_speed; });

  CLI::App* methods = app.add_subcommand(
      "methods", "method, triangles hidden and seen, work, ms, ms a unit of work, each a cell");
  add_scene_options(*methods, options);
  add_method_options(*methods, options);
  methods->callback([&] { run = print_methods; });

  CLI::App* profile = app.add_subcommand(
      "profile", "step, ms, operations, MB read and written in a row, floor in ms, each a cell");
  add_scene_options(*profile, options);
  add_method_options(*profile, options);
  profile->callback([&] { run = print_profile; });

  CLI::App* sampling = app.add_subcommand(
      "sampler", "rays, checks, % of objects and of triangles found, objects beyond, ms a cell");
  add_scene_options(*sampling, options);
  sampling->add_option("--rays", options.rays, "of the reference, a cell");
  sampling->add_option("--budgets", options.budgets, "rays of the sampler, a cell; a row each");
  sampling->callback([&] { run = print_sampling; });

  CLI::App* farm = app.add_subcommand("farm", "the real programs, one worker and two");
  add_scene_options(*farm, options);
  farm->add_option("--bin", options.bin_folder, "folder of the programs")->required();
  farm->add_option("--work", options.work_folder, "folder for files")->required();
  farm->add_option("--runs", options.runs, "of each; the fastest counts");
  farm->add_flag("--must-hold", options.must_hold,
                 "fail if two workers are less than 1.9 times as fast as one, or the coordinator "
                 "takes more than 0.2 ms a cell");
  farm->callback([&] { run = print_farm; });

  CLI11_PARSE(app, argc, argv);
  const Status status = run(options);
  if (status.ok()) return 0;
  std::fprintf(stderr, "bench_accuracy: %s\n", status.error().text.c_str());
  return static_cast<int>(status.error().kind);
}

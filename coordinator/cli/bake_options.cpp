#include "coordinator/cli/bake_options.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <sstream>

#include "common/scene/import.hpp"
#include "common/scene/scene_build.hpp"
#include "coordinator/cli/bake_summary.hpp"

namespace pvsfarm {
namespace {

constexpr double kDefaultCells = 10'000;  // over the ground of the scene, walkable or not

// The size of grid cells where none is asked for: so many would cover the scene's ground; a round
// number, at least a metre.
double fitting_cell_size(const Box& bounds) {
  const Vec3 size = bounds.size();
  const double wanted = std::sqrt(std::max(size.x * size.y, 1.0) / kDefaultCells);
  double step = 1;
  for (const double factor : {2.0, 2.5, 2.0, 2.0, 2.5, 2.0, 2.0, 2.5, 2.0}) {
    if (step >= wanted) break;
    step *= factor;
  }
  return step;
}

Result<std::vector<RootCell>> root_cells(const BakeOptions& options, const Scene& scene,
                                         const FarmObserver& observer) {
  if (!options.cells.empty() && options.cells.rfind("grid:", 0) != 0)
    return read_cells(options.cells);
  GridRequest request{.size = fitting_cell_size(scene.bounds())};
  if (!options.cells.empty()) {
    const Result<GridRequest> asked = parse_grid(options.cells);
    if (!asked) return Error{ErrorKind::kCommandLine, asked.error().text};
    request = *asked;
  }
  auto cells = grid_cells(scene, request);
  if (!cells) return cells.error();
  if (options.cells.empty()) {
    std::ostringstream text;
    text << "no --cells given: a grid of " << request.size << " m, " << cells->size()
         << " cells over the walkable ground";
    observer.note(text.str());
  }
  return cells;
}

std::string method_names(Methods methods) {
  std::string names;
  for (int i = 0; i < kMethodCount; ++i)
    if (methods.has(static_cast<Method>(i)))
      names += std::string(names.empty() ? "" : ",") + to_string(static_cast<Method>(i));
  return names;
}

// Errors: the text says which names there are.
Result<Methods> methods_in(const std::string& list) {
  std::uint32_t bits = 0;
  std::istringstream names(list);
  for (std::string name; std::getline(names, name, ',');) {
    const std::optional<Method> method = method_named(name);
    if (!method)
      return Error{ErrorKind::kCommandLine, "no method \"" + name + "\"; a list, with commas, of " +
                                                method_names(Methods::from_bits(~0u))};
    bits |= Methods{*method}.bits();
  }
  return Methods::from_bits(bits);
}

void add_scene_options(CLI::App& command, BakeOptions& options) {
  command.add_option("scene", options.scene, "glTF, GLB, OBJ or PLY")->required();
  command.add_option("-o,--output", options.output, "the store, OUT.pvs")->required();
  command.add_option("--cells", options.cells,
                     "FILE.json, or grid:SIZE[:HEIGHT] over the walkable ground; default: a grid");
  command.add_option("--tags", options.tags, "FILE.json: what occludes, what is culled");
  command.add_option("--occluders", options.occluders, "a scene file of geometry that only hides");
  command.add_option("--up", options.up, "y or z; default: y for glTF, z for others")
      ->check(CLI::IsMember({"y", "z"}));
}

void add_subdivision_options(CLI::App& command, SubdivisionSettings& settings) {
  command
      .add_option("--budget", settings.budget_triangles,
                  "split cells whose PVS holds more triangles; 0: never")
      ->capture_default_str();
  command
      .add_option("--min-cell", settings.min_cell_m,
                  "never split a side shorter than twice this, in metres")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command
      .add_option("--split-gain", settings.split_gain,
                  "do not split where one viewpoint sees all but this part of the PVS; 0: split")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command
      .add_option("--merge-tolerance", settings.merge_tolerance,
                  "halves become one again if that adds at most this part; negative: never")
      ->check(CLI::Range(-1.0, 100.0))
      ->capture_default_str();
}

// How hard a cell is tried.
void add_effort_options(CLI::App& command, BakeOptions& options) {
  EvaluatorSettings& settings = options.settings.evaluator;
  command
      .add_option("--gap", settings.gap,
                  "a cell is done when this part of its PVS, in triangles, is not certainly seen")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command
      .add_option("--rays", settings.max_rays,
                  "at most so many rays a cell look for what is certainly seen; 0: none")
      ->capture_default_str();
  command
      .add_option("--hints", settings.hint_viewpoints,
                  "viewpoints a cell from which OUT.pvs.hints tells how often and how large each "
                  "object shows, for levels of detail; 0: no such file")
      ->check(CLI::Range(std::uint32_t{0}, kMaxHintViewpoints))
      ->capture_default_str();
  command
      .add_option("--cell-time", settings.time_ms,
                  "nominal ms after which no further method is begun; 0: no limit. Counted in work "
                  "at fixed prices, the same on every machine")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command
      .add_option("--methods", options.methods,
                  "which to use, of " + method_names(Methods::from_bits(~0u)))
      ->check(CLI::Validator(
          [](const std::string& list) {
            const auto methods = methods_in(list);
            return methods ? std::string() : methods.error().text;
          },
          "LIST"))
      ->capture_default_str();
}

void add_projection_options(CLI::App& command, BakeOptions& options) {
  EvaluatorSettings& settings = options.settings.evaluator;
  command.add_option("--raster", options.raster, "osmesa or direct")
      ->check(CLI::IsMember({"osmesa", "direct"}))
      ->capture_default_str();
  command.add_option("--resolution", settings.resolution_px, "pixels a side of a map")
      ->check(CLI::Range(64, 1024))
      ->capture_default_str();
  command.add_option("--planes", settings.planes_per_face, "projection planes a cell face")
      ->check(CLI::Range(1, 16))
      ->capture_default_str();
  command
      .add_option("--extent", settings.extent,
                  "half side of a map over cell half side and distance")
      ->check(CLI::Range(0.25, 4.0))
      ->capture_default_str();
  command.add_option("--near", settings.near_m, "matter nearer to the cell never hides, in metres")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
}

}  // namespace

std::shared_ptr<BakeOptions> add_bake_options(CLI::App& command) {
  auto options = std::make_shared<BakeOptions>();
  options->methods = method_names(options->settings.evaluator.methods);
  add_scene_options(command, *options);
  add_subdivision_options(command, options->settings.subdivision);
  add_effort_options(command, *options);
  add_projection_options(command, *options);
  command
      .add_option("--lease", options->lease_s,
                  "seconds without progress after which a worker's cells go to others")
      ->check(CLI::Range(1.0, 3600.0))
      ->capture_default_str();
  CLI::Option* fresh = command.add_flag("--fresh", options->fresh,
                                        "discard what an earlier bake left, and begin anew");
  command
      .add_flag("--no-resume", options->no_resume,
                "begin anew, leave an earlier bake's journal as it is, and keep none")
      ->excludes(fresh);
  command.add_flag("--json", options->json, "the summary as one JSON object");
  add_watch_options(command, options->watch);
  return options;
}

Result<BakeJob> prepare_job(const BakeOptions& options, const FarmObserver& observer) {
  ImportOptions import{.scene_path = options.scene,
                       .up = std::nullopt,
                       .tags_path = options.tags,
                       .occluders_path = options.occluders};
  if (!options.up.empty()) import.up = options.up == "y" ? UpAxis::kY : UpAxis::kZ;
  auto imported = import_scene(import);
  if (!imported) return imported.error();
  for (const std::string& warning : imported->warnings) observer.warning(warning);
  auto scene = build_scene(std::move(imported->source));
  if (!scene) {
    Error error = scene.error();
    error.text = options.scene + ": " + error.text;
    return error;
  }
  BakeJob job{.settings = options.settings,
              .output = options.output,
              .fresh = options.fresh,
              .resume = !options.no_resume};
  job.settings.evaluator.raster =
      options.raster == "osmesa" ? RasterKind::kOsmesa : RasterKind::kDirect;
  const auto methods = methods_in(options.methods);
  if (!methods) return methods.error();
  job.settings.evaluator.methods = *methods;
  // One budget: the evaluator tries harder where the coordinator would split.
  job.settings.evaluator.budget_triangles = job.settings.subdivision.budget_triangles;
  auto roots = root_cells(options, **scene, observer);
  if (!roots) return roots.error();
  job.roots = std::move(roots).value();
  observer.note(std::to_string((*scene)->object_count()) + " objects, " +
                std::to_string((*scene)->all_triangles().size()) + " triangles, " +
                std::to_string(job.roots.size()) + " cells");
  job.scene = std::move(scene).value();
  return job;
}

Status run_bake(const BakeOptions& options, FarmOptions farm, const CommandContext& context) {
  farm.lease = std::chrono::milliseconds(static_cast<std::int64_t>(options.lease_s * 1e3));
  if (Status status = check_output(options.output); !status) return status;
  const auto watch = Watch::begin(options.watch, context);
  if (!watch) return watch.error();
  const FarmObserver& observer = (*watch)->observer();
  Result<BakeJob> job = prepare_job(options, observer);
  if (!job) return job.error();
  const Methods methods = job->settings.evaluator.methods;
  (*watch)->start(options.output, job->roots.size());
  const Result<BakeSummary> summary = bake(std::move(job).value(), farm, observer);
  (*watch)->finish();
  if (!summary) return summary.error();
  if (summary->already_baked) observer.note(options.output + ": already baked");
  if (options.json)
    std::cout << bake_summary_json(options.output, *summary, methods);
  else if (!summary->already_baked && context.verbosity >= 0)
    std::cout << bake_summary_text(options.output, *summary, methods, context.verbosity);
  if (summary->store.quarantined > 0)
    return Error{ErrorKind::kIncomplete,
                 options.output + ": " + std::to_string(summary->store.quarantined) +
                     " cells could not be evaluated and keep their parent's set; the same command "
                     "tries them again"};
  return {};
}

}  // namespace pvsfarm

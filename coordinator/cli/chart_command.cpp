// `pvsfarm chart SCENE`: accuracy against time, measured on a sample of the scene's cells.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>

#include "common/base/file.hpp"
#include "coordinator/chart/draw.hpp"
#include "coordinator/chart/measure.hpp"
#include "coordinator/chart/table.hpp"
#include "coordinator/cli/bake_options.hpp"
#include "coordinator/cli/command.hpp"
#include "coordinator/service/inquiries.hpp"

namespace pvsfarm {
namespace {

struct ChartOptions {
  BakeOptions scene;  // only what names the scene and its cells
  std::string name;
  std::size_t sample = 24;
  std::uint64_t seed = 1;
  std::vector<std::string> series;
  SeriesBase base;
  int runs = 2;
  unsigned workers = 2;
  std::vector<std::string> data;
  std::string kind = "accuracy";
  std::string spec, svg, json, vl2svg = "vl2svg";
};

std::string names_of_series() {
  std::string text;
  for (const Series& series : all_series())
    text += std::string(text.empty() ? "" : ", ") + series.name;
  return text;
}

// What the command has to show: of the data files, and of what is measured.
struct ChartData {
  std::vector<ChartRow> rows;
  std::vector<StabilityRow> stability;
};

Status read_data(const ChartOptions& options, ChartKind kind, ChartData& out) {
  for (const std::string& path : options.data) {
    const auto text = read_file(path);
    if (!text) return text.error();
    if (kind == ChartKind::kStability) {
      const auto rows = parse_stability_rows(*text, path);
      if (!rows) return rows.error();
      out.stability.insert(out.stability.end(), rows->begin(), rows->end());
    } else {
      const auto rows = parse_chart_rows(*text, path);
      if (!rows) return rows.error();
      out.rows.insert(out.rows.end(), rows->begin(), rows->end());
    }
  }
  const auto asked = [&](const ChartRow& row) {
    return options.series.empty() || std::find(options.series.begin(), options.series.end(),
                                               row.series) != options.series.end();
  };
  std::erase_if(out.rows, [&](const ChartRow& row) { return !asked(row); });
  return {};
}

// Those asked for, or else those that the chart shows.
std::vector<const Series*> chosen_series(const ChartOptions& options) {
  const auto asked =
      options.series.empty() ? series_shown(*chart_kind_named(options.kind)) : options.series;
  std::vector<const Series*> chosen;
  for (const Series& series : all_series())
    if (std::find(asked.begin(), asked.end(), series.name) != asked.end())
      chosen.push_back(&series);
  return chosen;
}

Status write_outputs(const ChartOptions& options, ChartKind kind, const ChartData& data) {
  if (!options.json.empty()) {
    std::string lines;
    for (const ChartRow& row : data.rows) lines += to_json(row) + "\n";
    if (Status written = write_file(options.json, lines); !written) return written;
  }
  const bool stability = kind == ChartKind::kStability;
  if (!options.spec.empty() || !options.svg.empty()) {
    const auto spec = stability ? stability_spec(data.stability) : chart_spec(kind, data.rows);
    if (!spec) return spec.error();
    if (!options.spec.empty())
      if (Status written = write_file(options.spec, *spec); !written) return written;
    if (!options.svg.empty()) {
      const Status drawn = draw_svg({.spec = *spec, .svg = options.svg, .program = options.vl2svg});
      if (!drawn) return drawn;
    }
  }
  const auto table = stability ? Result<std::string>(stability_table(data.stability))
                               : chart_table(kind, data.rows);
  if (!table) return table.error();
  std::cout << *table;
  return {};
}

Status check_violations(const ChartData& data) {
  for (const ChartRow& row : data.rows)
    if (row.violations > 0)
      return Error{ErrorKind::kViolation,
                   row.scene + ", " + row.series + ", " + row.label + ": " +
                       std::to_string(row.violations) +
                       " objects were declared hidden that were seen; this is a bug of pvsfarm"};
  return {};
}

// Asks a farm of local workers; the answers in the tasks' order.
Result<std::vector<CellDelta>> evaluate_on_farm(std::span<const ChartTask> tasks,
                                                const InquiryJob& job, const FarmOptions& farm,
                                                const FarmObserver& observer) {
  VisibleSet everything = VisibleSet::all(job.scene->object_count());
  for (std::uint32_t i = 0; i < job.scene->object_count(); ++i)
    if (!job.scene->object(ObjectId{i}).occludee) everything.remove(ObjectId{i});
  std::vector<Question> questions;
  for (const ChartTask& task : tasks)
    questions.push_back(EvaluateQuestion{
        .key = task.key, .cell = task.cell, .parent = everything, .settings = task.settings});
  std::vector<CellDelta> deltas(tasks.size());
  QuestionList list(std::move(questions), [&](std::uint32_t number, Finding finding) {
    deltas[number] = std::get<CellDelta>(std::move(finding));
  });
  const auto summary = run_inquiries(job, list, farm, observer);
  if (!summary) return summary.error();
  if (summary->interrupted || summary->answered < tasks.size()) {
    if (list.failures().empty()) return Error{ErrorKind::kInterrupted, "interrupted"};
    return runtime_error(std::to_string(list.failures().size()) + " of " +
                         std::to_string(tasks.size()) + " evaluations failed on every worker");
  }
  return deltas;
}

Result<std::vector<ChartRow>> measure_scene(const ChartOptions& options,
                                            const CommandContext& context) {
  const auto watch = Watch::begin({}, context);
  if (!watch) return watch.error();
  const FarmObserver& observer = (*watch)->observer();
  auto job = prepare_job(options.scene, observer);
  if (!job) return job.error();
  ChartRequest request{.scene_name = options.name,
                       .scene = std::move(job->scene),
                       .cells = std::move(job->roots),
                       .sample = options.sample,
                       .seed = options.seed,
                       .series = chosen_series(options),
                       .base = options.base,
                       .runs = options.runs};
  if (request.scene_name.empty())
    request.scene_name = std::filesystem::path(options.scene.scene).stem().string();
  const auto beside = std::filesystem::path(context.program).parent_path() / "pvsfarm-worker";
  const FarmOptions farm{.local_workers = options.workers,
                         .worker_program = beside.string(),
                         .worker_arguments = {context.verbosity > 0 ? "--verbose" : "--quiet"}};
  const InquiryJob inquiry{.scene = request.scene, .settings = options.base.settings};
  return measure(request, [&](std::span<const ChartTask> tasks) {
    return evaluate_on_farm(tasks, inquiry, farm, observer);
  });
}

Status chart(const ChartOptions& options, const CommandContext& context) {
  const ChartKind kind = *chart_kind_named(options.kind);
  if (options.scene.scene.empty() == options.data.empty())
    return Error{ErrorKind::kCommandLine,
                 "chart: either a scene to measure, or --data with what was measured"};
  if (!options.scene.scene.empty() && kind == ChartKind::kStability)
    return Error{ErrorKind::kCommandLine,
                 "chart: a chart of stability is drawn from --data of `pvsfarm stability`"};
  ChartData data;
  if (Status read = read_data(options, kind, data); !read) return read;
  if (!options.scene.scene.empty()) {
    auto rows = measure_scene(options, context);
    if (!rows) return rows.error();
    data.rows = std::move(rows).value();
  }
  if (Status written = write_outputs(options, kind, data); !written) return written;
  return check_violations(data);
}

void add_scene_options(CLI::App& command, ChartOptions& options) {
  command.add_option("scene", options.scene.scene, "glTF, GLB, OBJ or PLY: to be measured");
  command.add_option("--cells", options.scene.cells,
                     "FILE.json, or grid:SIZE[:HEIGHT] over the walkable ground; default: a grid");
  command.add_option("--tags", options.scene.tags, "FILE.json: what occludes, what is culled");
  command.add_option("--occluders", options.scene.occluders,
                     "a scene file of geometry that only hides");
  command.add_option("--up", options.scene.up, "y or z; default: y for glTF, z for others")
      ->check(CLI::IsMember({"y", "z"}));
  command.add_option("--name", options.name, "of the scene in charts; default: the file's");
}

void add_measuring_options(CLI::App& command, ChartOptions& options) {
  std::vector<std::string> names;
  for (const Series& series : all_series()) names.emplace_back(series.name);
  command.add_option("--sample", options.sample, "how many cells, spread over the scene")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command.add_option("--seed", options.seed, "of the sample")->capture_default_str();
  command
      .add_option("--series", options.series, "which to measure or show, of: " + names_of_series())
      ->delimiter(',')
      ->check(CLI::IsMember(names));
  command.add_option("--gap", options.base.settings.gap, "certified gap that a bake asks for")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command
      .add_option("--max-rays", options.base.settings.max_rays,
                  "rays a cell, of the cascade's witnesses")
      ->capture_default_str();
  command
      .add_option("--sampling-rays", options.base.max_sampling_rays,
                  "the most rays a cell of the series that only samples")
      ->check(CLI::Range(10'000, 1'000'000'000))
      ->capture_default_str();
  command
      .add_option("--near", options.base.settings.near_m,
                  "matter nearer to the cell never hides, in metres")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command.add_option("--runs", options.runs, "of every evaluation; the fastest counts")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command.add_option("--workers", options.workers, "worker processes")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
}

}  // namespace

void add_chart_command(CLI::App& app, CommandContext& context) {
  CLI::App* command =
      app.add_subcommand("chart", "accuracy against time, measured on a sample of a scene's cells");
  auto options = std::make_shared<ChartOptions>();
  add_scene_options(*command, *options);
  add_measuring_options(*command, *options);
  std::vector<std::string> kinds;
  for (const ChartKind kind : kChartKinds) kinds.emplace_back(to_string(kind));
  command->add_option("--kind", options->kind, "what is drawn")
      ->check(CLI::IsMember(kinds))
      ->capture_default_str();
  command->add_option("--data", options->data,
                      "files of --json to show together, instead of measuring");
  command->add_option("-o,--output", options->spec, "the chart as Vega-Lite, NAME.vl.json");
  command->add_option("--svg", options->svg, "the chart drawn, NAME.svg");
  command->add_option("--vl2svg", options->vl2svg, "the program that draws")->capture_default_str();
  command->add_option("--json", options->json, "the figures, one JSON object a line");
  command->footer(
      "The figures are printed as a Markdown table. Every point evaluates the same cells, each on\n"
      "its own. What any of them sees must be hidden from none: else the exit code is 7.\n"
      "Examples:\n"
      "  pvsfarm chart city.glb --cells city.cells.json --json city.jsonl -o city.vl.json\n"
      "  pvsfarm chart city.glb --series bake,sampling --kind rival --gap 0.15\n"
      "  pvsfarm chart --data a.jsonl --data b.jsonl --series cascade,sampling --svg both.svg");
  command->callback([&context, options] {
    context.run = [&context, options] { return chart(*options, context); };
  });
}

}  // namespace pvsfarm

// `pvsfarm explain`: why an object is, or is not, in a cell's visible set.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>

#include "common/base/log.hpp"
#include "common/pvs/store_reader.hpp"
#include "coordinator/cli/command.hpp"
#include "coordinator/cli/explain_picture.hpp"
#include "coordinator/cli/explain_text.hpp"
#include "coordinator/cli/explanation.hpp"
#include "coordinator/cli/store_scene.hpp"
#include "coordinator/cli/text.hpp"
#include "coordinator/service/bake_identity.hpp"
#include "coordinator/service/inquiries.hpp"

namespace pvsfarm {
namespace {

struct ExplainOptions {
  StoreSceneOptions files;
  std::string object, picture;
  std::optional<std::uint32_t> cell;
  std::vector<double> at;
  bool json = false;
};

Result<BakeSettings> read_settings(StoreReader& store) {
  const auto settings = read_settings_of(store);
  if (!settings) return settings.error();
  std::vector<RootCell> roots;
  for (std::uint32_t i = 0; i < store.node_count();) {
    const auto root = store.node(i);
    if (!root) return root.error();
    roots.push_back({root->root_id, root->cell});
    i = root->end;
  }
  if (bake_digest_of(store.header().scene_digest, roots, *settings) != store.header().bake_digest)
    log_warning(store.path() +
                ": another version of pvsfarm baked this store; what it did may "
                "differ from what is told here");
  return *settings;
}

Result<std::uint32_t> chosen_cell(StoreReader& store, const ExplainOptions& options) {
  if (options.cell) {
    if (*options.cell < store.node_count()) return *options.cell;
    return Error{ErrorKind::kCommandLine,
                 "--cell " + std::to_string(*options.cell) + ": " + store.path() + " has " +
                     counted(store.node_count(), "cell", "cells") + ", the first is 0"};
  }
  const Vec3 point{options.at[0], options.at[1], options.at[2]};
  auto cells = store.leaves_at(internal_from_file(store.header().up, point));
  if (!cells) return cells.error();
  if (cells->empty()) return invalid_input(store.path() + ": no cell holds " + point_text(point));
  return cells->front();
}

// A worker of this machine, for as long as it takes.
AskWorker ask_one_worker(std::shared_ptr<const Scene> scene, const EvaluatorSettings& settings,
                         const CommandContext& context) {
  FarmOptions farm{
      .local_workers = 1,
      .worker_program = std::filesystem::path(context.program).parent_path() / "pvsfarm-worker"};
  FarmObserver observer{.progress = [](const StatusReport&) {},
                        .note = [](const std::string&) {},
                        .warning = [](const std::string& text) { log_warning(text); }};
  return
      [scene = std::move(scene), settings, farm = std::move(farm), observer = std::move(observer)](
          const std::vector<ExplainQuestion>& questions) -> Result<std::vector<ExplainFinding>> {
        std::vector<ExplainFinding> findings(questions.size());
        QuestionList list({questions.begin(), questions.end()},
                          [&](std::uint32_t number, Finding finding) {
                            findings[number] = std::get<ExplainFinding>(std::move(finding));
                          });
        const auto summary =
            run_inquiries({.scene = scene, .settings = settings}, list, farm, observer);
        if (!summary) return summary.error();
        if (summary->interrupted) return Error{ErrorKind::kInterrupted, "interrupted"};
        if (!list.failures().empty())
          return runtime_error("the worker could not evaluate the cell");
        return findings;
      };
}

Status run_explain(const ExplainOptions& options, const CommandContext& context) {
  auto store = StoreReader::open(options.files.store);
  if (!store) return store.error();
  const auto object = object_named(**store, options.object);
  if (!object) return object.error();
  const auto cell = chosen_cell(**store, options);
  if (!cell) return cell.error();
  const auto settings = read_settings(**store);
  if (!settings) return settings.error();
  auto scene = read_scene_of(**store, options.files);
  if (!scene) return scene.error();
  const auto explanation = explain_in_store(**store, settings->subdivision, *cell, *object,
                                            ask_one_worker(*scene, settings->evaluator, context));
  if (!explanation) return explanation.error();
  const auto objects = (*store)->objects();
  if (!objects) return objects.error();
  const UpAxis up = (*store)->header().up;
  std::cout << (options.json ? json_of(*explanation, up, *objects) + '\n'
                             : text_of(*explanation, up, *objects));
  return options.picture.empty() ? Status()
                                 : draw_explanation(*explanation, *objects, options.picture);
}

}  // namespace

void add_explain_command(CLI::App& app, CommandContext& context) {
  auto options = std::make_shared<ExplainOptions>();
  CLI::App* command =
      app.add_subcommand("explain", "why an object is, or is not, in a cell's visible set");
  add_store_scene_options(*command, options->files);
  command->add_option("--object", options->object, "its name, or #ID as query numbers it")
      ->required();
  auto* where = command->add_option_group("where", "a cell");
  where->add_option("--cell", options->cell, "by its number, as query and export give it");
  where->add_option("--at", options->at, "the cell of a point, in the scene file's coordinates")
      ->delimiter(',')
      ->expected(3)
      ->type_name("X,Y,Z");
  where->require_option(1);
  command->add_flag("--json", options->json, "one JSON object instead of text");
  command->add_option("--picture", options->picture, "a PNG of cell, object and what is between");
  command->footer(
      "Evaluates the cell again, as the bake did, and tells what settled the object: a line of\n"
      "sight, or the plane that hides it and whose matter covers its views there.\n"
      "Examples:\n"
      "  pvsfarm explain city.pvs city.glb --cell 12 --object building_1_3_7\n"
      "  pvsfarm explain city.pvs city.glb --at 12,3,1.7 --object '#40' --picture why.png");
  command->callback([&context, options] {
    context.run = [&context, options] { return run_explain(*options, context); };
  });
}

}  // namespace pvsfarm

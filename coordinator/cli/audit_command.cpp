// `pvsfarm audit STORE SCENE`: tries to falsify a finished store.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>

#include "common/base/log.hpp"
#include "coordinator/cli/audit_report.hpp"
#include "coordinator/cli/command.hpp"
#include "coordinator/cli/door.hpp"
#include "coordinator/cli/progress_line.hpp"
#include "coordinator/cli/store_scene.hpp"
#include "coordinator/cli/text.hpp"
#include "coordinator/service/inquiries.hpp"

namespace pvsfarm {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kForTheReport = std::chrono::milliseconds(500);

struct AuditOptions {
  StoreSceneOptions scene;
  double seconds = 30;
  unsigned workers = 2;
  Door door;
  std::optional<FarmKeys> keys;
  std::uint64_t seed = 1;
  std::size_t plant = 0;
  bool json = false;
};

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// A progress line that speaks of rays.
FarmObserver observe_audit(const CommandContext& context, const StoreAudit& audit,
                           Clock::time_point deadline) {
  auto line = std::make_shared<ProgressLine>(ProgressLine::Options{
      .terminal = isatty(STDERR_FILENO) == 1, .quiet = context.verbosity < 0});
  FarmObserver observer;
  observer.note = [line](const std::string& text) {
    line->clear();
    log_info(text);
  };
  observer.warning = [line](const std::string& text) {
    line->clear();
    log_warning(text);
  };
  observer.progress = [line, &audit, deadline](const StatusReport& report) {
    const AuditFigures f = audit.figures();
    const double left = std::max(0.0, -seconds_since(deadline));
    line->show_text(grouped(f.leaves_reached) + " of " + grouped(f.leaves) + " leaf cells, " +
                        grouped(f.rays) + " rays, " +
                        counted(audit.violation_count(), "violation", "violations") + ", " +
                        duration_text(left) + " left",
                    report.elapsed_ms);
  };
  return observer;
}

struct Farm {
  InquiryJob job;
  FarmOptions options;
};

// As few as they are, those questions are asked with a farm of their own.
AskAudits ask_with(const Farm& farm, const FarmObserver& observer) {
  return [&](const std::vector<Question>& questions) -> Result<std::vector<AuditFinding>> {
    std::vector<AuditFinding> findings(questions.size());
    QuestionList list(questions, [&](std::uint32_t number, Finding finding) {
      findings[number] = std::get<AuditFinding>(std::move(finding));
    });
    const auto summary = run_inquiries(farm.job, list, farm.options, observer);
    if (!summary) return summary.error();
    if (summary->interrupted) return Error{ErrorKind::kInterrupted, "stopped while planting"};
    return findings;
  };
}

Farm farm_for(const AuditOptions& options, const CommandContext& context,
              std::shared_ptr<const Scene> scene, const EvaluatorSettings& settings,
              Clock::time_point start) {
  const auto beside = std::filesystem::path(context.program).parent_path() / "pvsfarm-worker";
  Farm farm{.job = {.scene = std::move(scene), .settings = settings},
            .options = {.endpoint = options.door.endpoint,
                        .local_workers = options.door.endpoint.empty() ? options.workers : 0,
                        .worker_program = beside.string()}};
  farm.options.keys = options.keys;
  farm.options.worker_arguments = {context.verbosity > 0 ? "--verbose" : "--quiet"};
  farm.job.deadline =
      start +
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options.seconds)) -
      kForTheReport;
  return farm;
}

// How the command ends, once the report is out.
Status verdict(const AuditOptions& options, const AuditReport& report) {
  const std::string& store = options.scene.store;
  if (report.interrupted)
    return Error{ErrorKind::kInterrupted, "stopped; the report is of what was done until then"};
  if (report.figures.leaves_reached == 0)
    return runtime_error(store +
                         ": the time was too short to audit a single cell; give it more "
                         "--seconds");
  if (options.plant > report.plants_found())
    return runtime_error(store + ": the audit found " + std::to_string(report.plants_found()) +
                         " of " + std::to_string(options.plant) +
                         " planted objects; give it more --seconds");
  if (!report.violations.empty())
    return Error{ErrorKind::kViolation,
                 store + ": " + counted(report.violations.size(), "violation", "violations") +
                     ": an object is seen from a cell whose set lacks it" +
                     (options.plant > 0 ? " (planted ones among them)" : "")};
  if (report.figures.leaves_reached < report.figures.leaves)
    log_warning("the time was too short for " +
                grouped(report.figures.leaves - report.figures.leaves_reached) +
                " leaf cells; give it more --seconds");
  return {};
}

Status run_audit(const AuditOptions& options, const CommandContext& context) {
  const Clock::time_point start = Clock::now();
  auto opened = StoreReader::open(options.scene.store);
  if (!opened) return opened.error();
  StoreReader& store = **opened;
  const auto settings = read_settings_of(store);
  if (!settings) return settings.error();
  auto scene = read_scene_of(store, options.scene);
  if (!scene) return scene.error();
  auto audit = StoreAudit::make(store, options.seed);
  if (!audit) return audit.error();

  const Farm farm = farm_for(options, context, *scene, settings->evaluator, start);
  const FarmObserver observer = observe_audit(context, **audit, *farm.job.deadline);
  AuditReport report{.store = options.scene.store};
  if (options.plant > 0) {
    auto plants = choose_plants(store, options.plant, options.seed, ask_with(farm, observer));
    if (!plants) return plants.error();
    report.plants = std::move(plants).value();
    for (const Plant& plant : report.plants) (*audit)->plant(plant.cell, plant.object);
    if (report.plants.size() < options.plant)
      return runtime_error(options.scene.store + ": only " +
                           counted(report.plants.size(), "cell", "cells") +
                           " of those looked at see something plainly; plant fewer");
  }
  const auto summary = run_inquiries(farm.job, **audit, farm.options, observer);
  if (!summary) return summary.error();

  report.figures = (*audit)->figures();
  report.violations = (*audit)->violations();
  auto gaps = (*audit)->gaps();
  if (!gaps) return gaps.error();
  report.gaps = std::move(gaps).value();
  report.newly_seen = (*audit)->newly_seen();
  report.interrupted = summary->interrupted;
  report.seconds = seconds_since(start);
  const auto text = options.json ? audit_json(report, store) : audit_text(report, store);
  if (!text) return text.error();
  std::cout << *text;
  return verdict(options, report);
}

}  // namespace

void add_audit_command(CLI::App& app, CommandContext& context) {
  auto options = std::make_shared<AuditOptions>();
  CLI::App* command = app.add_subcommand("audit", "try to falsify a store: rays against its sets");
  add_store_scene_options(*command, options->scene);
  command->add_option("--seconds", options->seconds, "how long, the reading of the scene included")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--workers", options->workers, "worker processes")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  add_door_options(*command, options->door);
  command->add_option("--seed", options->seed, "another draws other rays")->capture_default_str();
  command->add_option("--plant", options->plant,
                      "take so many plainly visible objects out of the sets first, in memory: the "
                      "audit must find them");
  command->add_flag("--json", options->json, "one JSON object instead of text");
  command->footer(
      "Exit code 7: an object is seen from a cell whose set lacks it. 0 is no proof: nothing was\n"
      "found in the time. Every violation was checked anew in double precision.\n"
      "Examples:\n"
      "  pvsfarm audit city.pvs city.glb\n"
      "  pvsfarm audit city.pvs city.glb --seconds 600 --workers 8 --seed 7\n"
      "  pvsfarm audit city.pvs city.glb --plant 3    # is the audit itself any good?");
  command->callback([&context, options] {
    context.run = [&context, options]() -> Status {
      Result<std::optional<FarmKeys>> keys = keys_of(options->door);
      if (!keys) return keys.error();
      options->keys = *std::move(keys);
      return run_audit(*options, context);
    };
  });
}

}  // namespace pvsfarm

// What `bake` and `coordinate` have in common: their options, and turning them into a job.
#pragma once

#include <memory>
#include <string>

#include "common/base/result.hpp"
#include "coordinator/cli/command.hpp"
#include "coordinator/cli/watch.hpp"
#include "coordinator/service/bake.hpp"

namespace pvsfarm {

struct BakeOptions {
  std::string scene, output;
  std::string cells, tags, occluders;  // "" for none
  std::string up, raster = "direct";
  std::string methods;  // names with commas
  BakeSettings settings;
  double lease_s = 30;
  WatchOptions watch;
  bool fresh = false, no_resume = false, json = false;
};

// Declares the options on `command`; the answer lives as long as its callback.
std::shared_ptr<BakeOptions> add_bake_options(CLI::App& command);

// Reads scene and cells: every bad input is found here, before any work.
Result<BakeJob> prepare_job(const BakeOptions& options, const FarmObserver& observer);

// Runs it and prints the summary on stdout. Errors: also kIncomplete, after the store was written.
Status run_bake(const BakeOptions& options, FarmOptions farm, const CommandContext& context);

}  // namespace pvsfarm

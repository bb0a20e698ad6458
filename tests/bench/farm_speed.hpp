// The real programs, timed: a coordinator and its workers bake a part of a scene's cells.
#pragma once

#include <string>

#include "common/base/result.hpp"

namespace pvsfarm::bench {

struct FarmRun {
  double wall_ms = 0;  // from the first process's start to the coordinator's end
  double coordinator_cpu_ms = 0;  // once the scene is read
  double worker_cpu_ms = 0;  // of all workers
  std::string store_hash;    // of the finished store's bytes
};

struct FarmRequest {
  std::string bin_folder;   // with pvsfarm and pvsfarm-worker
  std::string work_folder;  // for store, journal, logs; emptied of them
  std::string scene_path;   // without its ending: .obj, .cells.json and .tags.json stand there
  int workers = 1;
};
// Errors: kRuntime with the log's path, if any of the processes fails.
Result<FarmRun> run_farm(const FarmRequest& request);

}  // namespace pvsfarm::bench

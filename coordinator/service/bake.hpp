// One bake from start to store: journal, poll loop, workers, final file.
#pragma once

#include <string>
#include <vector>

#include "common/cells/cell_source.hpp"
#include "common/pvs/settings.hpp"
#include "coordinator/merger/store_build.hpp"
#include "coordinator/service/farm.hpp"

namespace pvsfarm {

struct BakeJob {
  std::shared_ptr<const Scene> scene;  // given up for a file that the workers map, too
  std::vector<RootCell> roots;
  BakeSettings settings;
  std::string output;  // OUT.pvs; beside it OUT.pvs.journal while it is not complete
  bool fresh = false;  // discard a journal, whatever bake it belongs to
  bool resume = true;  // else neither goes on from a journal nor leaves one: it stays as it is
};

struct BakeSummary {
  bool already_baked = false;
  StoreFigures store;
  std::uint64_t disagreements = 0;   // cells that two workers answered differently
  std::uint64_t contradictions = 0;  // objects that a witness showed after a certificate hid them
  std::uint64_t evaluated = 0, resumed = 0;                         // in this run, from the journal
  double mean_objects = 0, mean_triangles = 0, culled_percent = 0;  // over the leaves
  std::uint64_t file_bytes = 0;
  double seconds = 0;
  double worker_cpu_ms_per_cell = 0;
  double coordinator_cpu_ms_per_cell = 0;  // once the scene is read, to the finished store
  std::uint64_t workers = 0;               // sessions in all
};

// Whether the store can be written there, before anything is computed for it. Errors: kIo.
Status check_output(const std::string& output);

// Requires: SIGINT, SIGTERM and SIGCHLD are this function's while it runs.
// Errors: kIo (output, journal), kDiskFailed (the journal while the bake runs), kInvalidInput
// (another bake's journal), kRuntime (no worker left), kInterrupted (Ctrl-C, drain, cancel). The
// journal stays.
Result<BakeSummary> bake(BakeJob job, const FarmOptions& farm, const FarmObserver& observer);

// Where a running coordinator of this output listens. Errors: kRuntime if there is none.
Result<std::string> endpoint_of(const std::string& output);

}  // namespace pvsfarm

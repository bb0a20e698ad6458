// A worker's life: connect, greet, get the scene, compute tasks, leave. The thread of the caller is
// the messenger; another computes.
#pragma once

#include <string>

#include "common/wire/keys.hpp"
#include "worker/service/compute.hpp"

namespace pvsfarm {

struct WorkerOptions {
  std::string endpoint;
  std::optional<ClientSecurity> security;  // none: the endpoint needs no keys
  std::string cache_folder;                // for scenes that are fetched
  double max_idle_s = 0;                   // leave after so long without a task; 0: never
  std::string build;                       // for people
  Kernel kernel;
};

// Until the bake is over, the coordinator refuses this worker, it idles too long, or SIGTERM or
// SIGINT: then it finishes what it computes, within 25 s. Returns the exit code; says on the log
// why.
int run_worker(const WorkerOptions& options, Workshop workshop);

}  // namespace pvsfarm

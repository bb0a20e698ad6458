// A farm at work: socket, poll loop, workers of this machine, for whatever is to be done.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/log.hpp"
#include "common/pvs/settings.hpp"
#include "common/scene/scene.hpp"
#include "common/wire/keys.hpp"
#include "common/wire/messages.hpp"
#include "coordinator/service/events.hpp"
#include "coordinator/service/private_folder.hpp"
#include "coordinator/service/work.hpp"

namespace pvsfarm {

// The coordinator's own key, and the file of those that are let in; it is read again at SIGHUP.
struct FarmKeys {
  KeyPair own;
  std::string allow_path;
};

struct FarmOptions {
  std::string endpoint;        // "": an ipc endpoint in a private folder
  unsigned local_workers = 2;  // 0: workers come by themselves
  std::string worker_program;
  std::vector<std::string> worker_arguments;
  // Without progress for so long, a worker's cells go to others. [ms]
  std::chrono::milliseconds lease = std::chrono::seconds(30);
  std::optional<FarmKeys> keys;  // none: then the endpoint must be one of this machine
  bool own_sessions = false;     // of the workers: the system then weighs each by itself
};

// Processors that this process may use, by its affinity and its control group; at least 1.
unsigned usable_processors();

// What happens meanwhile, for the command to show; each may be empty. Threads: the caller's.
struct FarmObserver {
  std::function<void(const StatusReport&)> progress;      // a few times a second
  std::function<void(const std::string&)> note, warning;  // lines for the log
  std::function<void(const LogEvent&)> event;  // the same with what it is about, and lesser news;
                                               // if empty, warnings go to `warning`
  std::function<void(const std::string&)> enter;  // "writing": what takes its time without turns
  FarmEvents* events = nullptr;                   // outlives the farm
};

struct FarmJob {
  std::shared_ptr<const Scene> scene;  // workers find it in the folder
  EvaluatorSettings settings;
  std::string pinned_kernel;  // "" for the first worker's
  std::string output;         // for the status
  TaskOrder order;
  std::optional<std::chrono::steady_clock::time_point> deadline;  // what is not done then stays so
  std::function<Status(const std::string& endpoint)> listening;   // may be empty
};

struct FarmFigures {
  std::string kernel;         // of the workers; "" if none came
  std::uint64_t workers = 0;  // sessions in all
};

// Requires: SIGINT, SIGTERM, SIGCHLD and, with keys, SIGHUP are this function's while it runs;
// folder.scene_path() holds the scene's bundle.
// Errors: those of the work; kIo (endpoint); kRuntime (no worker left, keys keep nobody out);
// kInterrupted (Ctrl-C, drain, cancel). `figures` holds but after kDiskFailed, which returns at
// once, without a good-bye.
Status run_farm(const FarmJob& job, Work& work, const PrivateFolder& folder,
                const FarmOptions& options, const FarmObserver& observer, FarmFigures& figures);

// Writes the scene where run_farm() wants it. Errors: kIo.
Status put_scene(const PrivateFolder& folder, std::span<const std::byte> bundle);

}  // namespace pvsfarm

#include "coordinator/service/farm.hpp"

#include <sys/resource.h>

#include <random>

#include "common/base/file.hpp"
#include "coordinator/journal/result_log.hpp"
#include "coordinator/service/farm_loop.hpp"

namespace pvsfarm {
namespace {

using namespace std::chrono_literals;
using Clock = FarmLoop::Clock;

DeskSettings desk_settings(const FarmJob& job, const FarmOptions& options, std::string scene_path,
                           Clock::time_point start, FarmEvents* events) {
  std::random_device device;
  DeskSettings settings{.evaluator = job.settings,
                        .scene_digest = job.scene->digest(),
                        .scene = job.scene->bundle(),
                        .scene_path = std::move(scene_path),
                        .pinned_kernel = job.pinned_kernel,
                        .output = job.output,
                        .events = events};
  settings.epoch = (static_cast<std::uint64_t>(device()) << 32 | device()) | 1;
  settings.limits.board.lease = settings.limits.board.stall = options.lease;
  settings.limits.board.deadline = 2 * options.lease;
  settings.limits.board.order = job.order;
  if (job.deadline) settings.deadline = std::chrono::duration_cast<Millis>(*job.deadline - start);
  return settings;
}

LocalWorkerOptions worker_options(const FarmOptions& options, const std::string& endpoint) {
  LocalWorkerOptions workers{
      options.worker_program, {"--connect", endpoint}, options.local_workers, options.own_sessions};
  workers.arguments.insert(workers.arguments.end(), options.worker_arguments.begin(),
                           options.worker_arguments.end());
  return workers;
}

// The good-bye must leave before the socket closes; each worker's answer is its BYE.
void say_good_bye(Router& router, Desk& desk, const FarmLoop& loop) {
  desk.say_shutdown();
  for (const Outgoing& out : desk.take_outgoing()) router.send(out.peer, out.envelope, out.message);
  for (const auto end = Clock::now() + 500ms; desk.session_count() > 0 && Clock::now() < end;) {
    router.wait(20ms);
    while (const auto received = router.receive())
      if (!desk.receive(received->peer, received->decoded, loop.now(), received->role)) return;
  }
}

// Each worker needs a file; what this process may have by default is 1,024.
void raise_file_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == limit.rlim_max) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

Result<std::unique_ptr<Router>> open_door(const FarmOptions& options, const PrivateFolder& folder) {
  const std::string endpoint = options.endpoint.empty() ? folder.endpoint() : options.endpoint;
  if (!options.keys) return Router::bind(endpoint);
  Result<AllowList> allow = AllowList::read(options.keys->allow_path);
  if (!allow) return allow.error();
  return Router::bind(endpoint, ServerSecurity{options.keys->own, std::move(allow).value()});
}

}  // namespace

Status run_farm(const FarmJob& job, Work& work, const PrivateFolder& folder,
                const FarmOptions& options, const FarmObserver& observer, FarmFigures& figures) {
  SignalWatch signals(options.keys.has_value());
  raise_file_limit();
  auto router = open_door(options, folder);
  if (!router) return router.error();
  const std::string endpoint = (*router)->endpoint();
  if (job.listening)
    if (Status status = job.listening(endpoint); !status) return status;
  if (options.local_workers == 0 && observer.note) observer.note("listening on " + endpoint);

  const Clock::time_point start = Clock::now();
  // Elsewhere the path would name another file, or none.
  const std::string scene_path = is_local(endpoint) ? folder.scene_path() : "";
  Desk desk(desk_settings(job, options, scene_path, start, observer.events), work, Millis(0));
  LocalWorkers workers(worker_options(options, endpoint));
  const bool local = options.local_workers > 0;
  if (local && !desk.done())
    if (Status status = workers.start(); !status) return status;

  FarmLoop loop(**router, desk, work, local ? &workers : nullptr, signals, observer, start);
  if (options.keys) loop.reload_at_hangup(options.keys->allow_path);
  const Status status = loop.run();
  if (!status && status.error().kind == kDiskFailed) {
    // No good-bye: workers elsewhere keep their results for the coordinator that is started again.
    workers.kill_all();
    return status;
  }
  say_good_bye(**router, desk, loop);
  figures = {desk.pinned_kernel(), desk.workers_seen()};
  return status;
}

Status put_scene(const PrivateFolder& folder, std::span<const std::byte> bundle) {
  return write_file(folder.scene_path(),
                    {reinterpret_cast<const char*>(bundle.data()), bundle.size()});
}

}  // namespace pvsfarm

// The coordinator's poll loop: one thread that moves messages between the Router and the desk,
// looks after local workers and signals, and tells how far the work is.
#pragma once

#include <chrono>

#include "common/wire/socket.hpp"
#include "coordinator/service/desk.hpp"
#include "coordinator/service/farm.hpp"
#include "coordinator/service/local_workers.hpp"
#include "coordinator/service/signals.hpp"

namespace pvsfarm {

class FarmLoop {
 public:
  using Clock = std::chrono::steady_clock;

  // Everything outlives the loop; `workers` may be null.
  FarmLoop(Router& router, Desk& desk, Work& work, LocalWorkers* workers, SignalWatch& signals,
           const FarmObserver& observer, Clock::time_point start)
      : router_(router),
        desk_(desk),
        work_(work),
        workers_(workers),
        signals_(signals),
        observer_(observer),
        start_(start) {}

  // Until everything is done, or the desk's deadline. Errors: those of the work; kRuntime, no
  // worker left; kInterrupted, after what was on its way has come in or two seconds have passed.
  Status run();

  // From then on SIGHUP has the keys that may come in read from this file.
  void reload_at_hangup(std::string allow_path) { allow_path_ = std::move(allow_path); }

  Millis now() const { return std::chrono::duration_cast<Millis>(Clock::now() - start_); }
  std::uint64_t cells_done() const { return cells_done_; }

 private:
  Status receive_some();
  Status keep_kernel();
  Status look_after_workers();
  void send_all();
  void say_how_far();
  bool asked_to_stop();
  void reload_keys();

  Router& router_;
  Desk& desk_;
  Work& work_;
  LocalWorkers* workers_;
  SignalWatch& signals_;
  const FarmObserver& observer_;
  Clock::time_point start_;
  std::string kept_kernel_;
  std::string allow_path_;  // "": no keys
  Millis next_progress_{0};
  std::optional<Millis> stop_at_;
  std::uint64_t cells_done_ = 0;
  bool more_waiting_ = false;
};

}  // namespace pvsfarm

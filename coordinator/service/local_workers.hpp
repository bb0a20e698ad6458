// The worker processes of a local bake: started beside the coordinator, started again when they
// die, ended with it.
// Threads: one; its thread must outlive the workers (they are killed when it ends).
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/base/result.hpp"

namespace pvsfarm {

struct LocalWorkerOptions {
  std::string program;  // pvsfarm-worker
  std::vector<std::string> arguments;
  unsigned count = 2;
  bool own_sessions = false;
};

class LocalWorkers {
 public:
  using Clock = std::chrono::steady_clock;

  explicit LocalWorkers(LocalWorkerOptions options);
  ~LocalWorkers();  // SIGTERM, and SIGKILL two seconds later
  LocalWorkers(const LocalWorkers&) = delete;
  LocalWorkers& operator=(const LocalWorkers&) = delete;

  // Errors: kRuntime (no such program, no more processes).
  Status start();
  // The processes that ended since the last call. `cells_done` grows while the farm works: only
  // deaths without any work between them count against the limit. `worked`: whether the process of
  // that number completed any cell; if it did not, the next one in its place waits longer.
  // Errors: kRuntime, if none is left and no more are to be started, naming the reason.
  struct Ended {
    std::uint32_t pid = 0;
    std::string how;  // "exit code 75", "killed by signal 9"
  };
  Result<std::vector<Ended>> look_after(std::uint64_t cells_done,
                                        const std::function<bool(std::uint32_t)>& worked,
                                        Clock::time_point now);
  std::size_t running() const;
  void kill_all();  // at once; nothing more is to be called

 private:
  struct Slot {
    int pid = 0;  // 0: not running
    Clock::time_point start_at{};
    unsigned fruitless = 0;  // processes in a row that completed nothing
    bool retired = false;    // asked not to be started again
  };
  Status spawn(Slot& slot);

  LocalWorkerOptions options_;
  std::vector<Slot> slots_;
  std::uint64_t cells_done_ = 0;
  unsigned deaths_without_work_ = 0;
  std::string last_end_;
};

}  // namespace pvsfarm

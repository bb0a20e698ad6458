// What happens in a farm, told while it happens to whoever wants to keep it: a trace, a test.
// Nobody may act on it: whoever listens must not change what the farm does.
// Threads: the coordinator's one.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "common/wire/messages.hpp"
#include "coordinator/board/board.hpp"
#include "coordinator/service/work.hpp"

namespace pvsfarm {

class FarmEvents {
 public:
  virtual ~FarmEvents() = default;

  struct Queue {
    std::uint64_t pending = 0, leased = 0, workers = 0;
  };
  enum class End { kDone, kFailed, kExpired, kReturned };

  virtual void worker_joined(WorkerId, const Hello&) = 0;
  virtual void worker_left(WorkerId, bool lost) = 0;
  virtual void task_given(WorkerId, const BoardTask&) = 0;
  // `done`: the cells that count, in the order of their evaluation; empty unless kDone.
  virtual void task_ended(BoardLease, End, std::span<const WorkAnswer::Done> done,
                          const std::string& text) = 0;
  virtual void commit_begins(std::size_t rows) = 0;
  virtual void commit_ends() = 0;
  virtual void queue(const Queue&) = 0;  // after whatever changed it
};

inline const char* to_string(FarmEvents::End end) {
  constexpr const char* kNames[] = {"done", "failed", "no progress", "returned"};
  return kNames[static_cast<int>(end)];
}

}  // namespace pvsfarm

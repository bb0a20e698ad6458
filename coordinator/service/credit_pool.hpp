// Who may send a large result: the memory for all of it is set aside first, in the order of asking,
// so that results that come in together always come to an end.
// Threads: one.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>

#include "coordinator/board/board.hpp"

namespace pvsfarm {

class CreditPool {
 public:
  // [limit] `limit` is not less than the largest result: that one fits when it is alone.
  explicit CreditPool(std::uint64_t limit) : limit_(limit) {}

  // Sets `bytes` aside for a worker, now or when next() says so.
  void ask(WorkerId worker, std::uint64_t bytes) {
    release(worker);
    waiting_.push_back({worker, bytes});
  }
  // Memory that is in use without having been asked for.
  void use(std::uint64_t bytes) { used_ += bytes; }
  void free(std::uint64_t bytes) { used_ -= bytes; }

  // The next worker whose result fits now.
  std::optional<WorkerId> next() {
    if (waiting_.empty() || (used_ > 0 && used_ + waiting_.front().bytes > limit_)) return {};
    const Asked asked = waiting_.front();
    waiting_.pop_front();
    held_[asked.worker] = asked.bytes;
    used_ += asked.bytes;
    return asked.worker;
  }
  // What a worker has, or waits for.
  void release(WorkerId worker) {
    std::erase_if(waiting_, [&](const Asked& asked) { return asked.worker == worker; });
    const auto held = held_.find(worker);
    if (held == held_.end()) return;
    used_ -= held->second;
    held_.erase(held);
  }
  std::uint64_t used() const { return used_; }

 private:
  struct Asked {
    WorkerId worker{};
    std::uint64_t bytes = 0;
  };
  std::uint64_t limit_;
  std::uint64_t used_ = 0;
  std::deque<Asked> waiting_;
  std::map<WorkerId, std::uint64_t> held_;
};

}  // namespace pvsfarm

// How far a bake is and how long it still takes, told honestly: what the open cells will cost is
// drawn from what cells of their depth did cost, splitting is expected as often as it happened, and
// a range says how sure that is.
// A pure function of what it is told; the time comes from outside. Threads: one.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>

#include "coordinator/board/board.hpp"

namespace pvsfarm {

struct ProgressFigures {
  std::uint64_t cells_done = 0, cells_open = 0;
  std::uint64_t cells_resumed = 0;  // of those done, not in this run
  double cells_expected = 0;        // done + open + what splitting will add
  double cells_per_second = 0;      // of late
  double eta_s = -1;                // negative: not known yet
  // About nine times of ten the truth is between them. A high one that is negative: eta_s rests on
  // cells of which too few are known, and may be far too low.
  double eta_low_s = -1, eta_high_s = -1;
};

class Estimate {
 public:
  void opened(int depth) { ++depths_[index(depth)].open; }
  void given_up(int depth) { --depths_[index(depth)].open; }
  // `live`: computed in this run; a result read back from the journal tells of costs, not of speed.
  struct Done {
    int depth = 0;
    double cost_ms = 0;
    bool split = false;
    bool live = true;
  };
  void done(const Done& done);
  // `now`: time in which the farm could work; it stands still while the farm is paused.
  ProgressFigures at(Millis now);

 private:
  struct Depth {
    std::uint64_t open = 0, done = 0, split = 0;
    double cost_ms = 0, squares = 0;  // sums
  };
  struct Sample {
    Millis time{};
    double cost_ms = 0;
    std::uint64_t cells = 0;
  };
  // Of all that is open, with all that will come of it.
  struct Remaining {
    double cost_ms = 0, cells = 0;
    double variance = 0;    // of cost_ms
    double unknown_ms = 0;  // of cost_ms, at depths of which too little is known
  };
  static std::size_t index(int depth) { return static_cast<std::size_t>(depth); }
  Remaining remaining() const;
  const Sample& since(Millis now);  // the sample from which the speed is told

  std::array<Depth, kMaxDepth + 1> depths_{};
  double live_cost_ms_ = 0;
  std::uint64_t live_cells_ = 0, resumed_cells_ = 0;
  Millis spacing_{500};         // of the samples
  std::deque<Sample> samples_;  // from the first live cell on
};

}  // namespace pvsfarm

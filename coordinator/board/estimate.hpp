// How far a bake is and how long it still takes, told honestly: what the open cells will cost is
// drawn from what cells of their depth did cost, and splitting is expected as often as it happened.
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
  double cells_expected = 0;    // done + open + what splitting will add
  double cells_per_second = 0;  // over the last half minute
  double eta_s = -1;            // negative: not known yet
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
  ProgressFigures at(Millis now);

 private:
  struct Depth {
    std::uint64_t open = 0, done = 0, split = 0;
    double cost_ms = 0;
  };
  struct Sample {
    Millis time{};
    double cost_ms = 0;
    std::uint64_t cells = 0;
  };
  static std::size_t index(int depth) { return static_cast<std::size_t>(depth); }

  std::array<Depth, kMaxDepth + 1> depths_{};
  double live_cost_ms_ = 0;
  std::uint64_t live_cells_ = 0;
  std::deque<Sample> samples_;  // at most one every kSampleSpacing, over kWindow
};

}  // namespace pvsfarm

// The record of a real bake, from the file of `--trace`, and how well the estimate of the time left
// would have done on it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/result.hpp"
#include "coordinator/board/estimate.hpp"

namespace pvsfarm {

struct TracedCell {
  double end_s = 0;  // when its task's result was there
  std::uint32_t root = 0;
  int depth = 0;
  double cpu_ms = 0;
  bool split = false;
};

struct TracedBake {
  std::uint64_t root_cells = 0;
  std::vector<TracedCell> cells;  // in the order of their results
  bool finished = false;          // its closing bracket is there
  std::size_t events = 0;
};

// Takes the file of a killed bake, too: what was written of its last line is left out.
// Errors: kIo; kInvalidInput, for what no trace viewer would read.
Result<TracedBake> read_bake_trace(const std::string& path);

// The same results in the same order, by a farm of even speed that takes `total_s` for all of them.
TracedBake at_even_speed(TracedBake bake, double total_s);

struct EtaSample {
  double time_s = 0, done = 0;  // which part of the time is over
  double left_s = 0;            // truly
  ProgressFigures told;
};
// What was told every `step` of the bake's time, from the beginning to the end.
std::vector<EtaSample> replay_estimate(const TracedBake& bake, int samples);

// How far an estimate may be off, once the part `from` of the time is over: by so much of the time
// that is truly left, or of all of it.
struct EtaLimits {
  double from = 0.2, of_left = 0.3, of_total = 0.03;
};
// The first that is off by more than that, or that was not told; none: it holds.
std::optional<EtaSample> first_beyond(const std::vector<EtaSample>& samples,
                                      const EtaLimits& limits = {});

}  // namespace pvsfarm

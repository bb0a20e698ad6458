// The record of a real bake, from the file of `--trace`, and how well the estimate of the time left
// would have done on it.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.hpp"
#include "coordinator/board/estimate.hpp"

namespace pvsfarm {

struct TracedCell {
  double end_s = 0;  // when its task's result was there
  CellKey key;
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

// The cells of a bake and what each cost, one a line, as tests/farm/estimates/record.py keeps them.
// Errors: kIo; kInvalidInput.
Result<TracedBake> read_cell_costs(const std::string& path);

// The same cells, handed out by the real board to workers that do nothing else and need for each
// what it cost once: a farm without the noise of the machine it ran on, and the same every time.
struct VirtualFarm {
  std::size_t workers = 2;
  double total_s = 600;  // its time is stretched to this
};
TracedBake baked_by(const VirtualFarm& farm, const TracedBake& bake);

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

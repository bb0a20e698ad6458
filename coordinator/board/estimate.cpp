#include "coordinator/board/estimate.hpp"

namespace pvsfarm {
namespace {
constexpr Millis kWindow{30'000};
constexpr Millis kSampleSpacing{500};
constexpr Millis kShortest{1'000};  // no speed is told from less
// A depth of which little is known borrows from the one above: it splits half as often (a smaller
// cell sees less) and costs the same, with the weight of so many cells.
constexpr double kPriorCells = 4;
constexpr double kPriorSplit = 0.5;
}  // namespace

void Estimate::done(const Done& done) {
  Depth& depth = depths_[index(done.depth)];
  --depth.open;
  ++depth.done;
  depth.cost_ms += done.cost_ms;
  if (done.split) ++depth.split;
  if (!done.live) return;
  live_cost_ms_ += done.cost_ms;
  ++live_cells_;
}

ProgressFigures Estimate::at(Millis now) {
  // 1. Mean cost and frequency of splitting at each depth.
  std::array<double, kMaxDepth + 1> cost{}, split{};
  ProgressFigures figures;
  double above_cost = 0, above_split = 0;
  for (std::size_t d = 0; d <= kMaxDepth; ++d) {
    const Depth& depth = depths_[d];
    const auto n = static_cast<double>(depth.done);
    const double prior = d == 0 ? 0 : kPriorCells;
    const double weight = n + prior;
    cost[d] = weight > 0 ? (depth.cost_ms + prior * above_cost) / weight : 0;
    const double prior_split = prior * above_split * kPriorSplit;
    split[d] = weight > 0 ? (static_cast<double>(depth.split) + prior_split) / weight : 0;
    above_cost = cost[d];
    above_split = split[d];
    figures.cells_done += depth.done;
    figures.cells_open += depth.open;
  }

  // 2. What an open cell and all its descendants will cost, deepest first.
  double below_cost = 0, below_cells = 0, remaining_ms = 0, remaining_cells = 0;
  for (std::size_t d = kMaxDepth + 1; d-- > 0;) {
    below_cost = cost[d] + 2 * split[d] * below_cost;
    below_cells = 1 + 2 * split[d] * below_cells;
    remaining_ms += static_cast<double>(depths_[d].open) * below_cost;
    remaining_cells += static_cast<double>(depths_[d].open) * below_cells;
  }
  figures.cells_expected = static_cast<double>(figures.cells_done) + remaining_cells;

  // 3. How fast the farm works off cost, over the window.
  if (samples_.empty() || now - samples_.back().time >= kSampleSpacing)
    samples_.push_back({now, live_cost_ms_, live_cells_});
  while (samples_.size() > 2 && now - samples_.front().time > kWindow) samples_.pop_front();
  const Sample& first = samples_.front();
  const double span_s = static_cast<double>((now - first.time).count()) / 1e3;
  if (now - first.time < kShortest || live_cells_ == first.cells) return figures;
  figures.cells_per_second = static_cast<double>(live_cells_ - first.cells) / span_s;
  const double cost_per_second = (live_cost_ms_ - first.cost_ms) / span_s;
  if (cost_per_second > 0) figures.eta_s = remaining_ms / cost_per_second;
  return figures;
}

}  // namespace pvsfarm

#include "coordinator/board/estimate.hpp"

#include <algorithm>
#include <cmath>

namespace pvsfarm {
namespace {
// Speed is told from the shortest past that is as long as each of these.
constexpr Millis kWindow{30'000};
constexpr std::uint64_t kWindowCells = 64;
constexpr double kWindowPart = 0.2;  // of the time since the first cell
constexpr Millis kShortest{1'000};   // no speed is told from less
constexpr std::size_t kMaxSamples = 2048;

// A depth of which little is known borrows from the one above: it splits half as often (a smaller
// cell sees less) and costs the same, with the weight of so many cells.
constexpr double kPriorCells = 4;
constexpr double kPriorSplit = 0.5;
constexpr double kKnownCells = 8;  // of a depth, before anybody speaks of a range

constexpr double kDeviations = 1.65;  // nine times of ten
// Cells near each other are alike, and they are done one after the other: so many of them tell as
// much as one drawn by lot.
constexpr double kAlike = 4;
constexpr double kSpeedError = 0.1;
constexpr double kUnknownPart = 0.2;  // of the cost; with more, no range is told
}  // namespace

void Estimate::done(const Done& done) {
  Depth& depth = depths_[index(done.depth)];
  --depth.open;
  ++depth.done;
  depth.cost_ms += done.cost_ms;
  depth.squares += done.cost_ms * done.cost_ms;
  if (done.split) ++depth.split;
  if (!done.live) {
    ++resumed_cells_;
    return;
  }
  live_cost_ms_ += done.cost_ms;
  ++live_cells_;
}

Estimate::Remaining Estimate::remaining() const {
  // 1. Mean cost, its variance and the frequency of splitting at each depth.
  struct Known {
    double cost_ms = 0, variance = 0, split = 0, cells = 0;
  };
  std::array<Known, kMaxDepth + 1> known{};
  Known above;
  for (std::size_t d = 0; d <= kMaxDepth; ++d) {
    const Depth& depth = depths_[d];
    const double prior = d == 0 ? 0 : kPriorCells;
    Known& here = known[d];
    here.cells = static_cast<double>(depth.done);
    if (const double weight = here.cells + prior; weight > 0) {
      const double square =
          (depth.squares + prior * (above.variance + above.cost_ms * above.cost_ms)) / weight;
      here.cost_ms = (depth.cost_ms + prior * above.cost_ms) / weight;
      here.variance = std::max(0.0, square - here.cost_ms * here.cost_ms);
      here.split = (static_cast<double>(depth.split) + prior * above.split * kPriorSplit) / weight;
    }
    above = here;
  }

  // 2. What an open cell and all its descendants will cost, deepest first.
  Remaining sum;
  double below_ms = 0, below_cells = 0, below_variance = 0;
  for (std::size_t d = kMaxDepth + 1; d-- > 0;) {
    const Known& here = known[d];
    const double s = here.split, children_ms = 2 * below_ms;
    below_variance =
        here.variance + 2 * s * below_variance + s * (1 - s) * children_ms * children_ms;
    below_ms = here.cost_ms + s * children_ms;
    below_cells = 1 + 2 * s * below_cells;
    const auto open = static_cast<double>(depths_[d].open);
    sum.cost_ms += open * below_ms;
    sum.cells += open * below_cells;
    // Each of them deviates from the mean, and the mean of those done from that of all.
    sum.variance += below_variance * (open + open * open * kAlike / std::max(here.cells, 1.0));
    if (here.cells < kKnownCells) sum.unknown_ms += open * below_ms;
  }
  return sum;
}

const Estimate::Sample& Estimate::since(Millis now) {
  if (samples_.empty() || now - samples_.back().time >= spacing_)
    samples_.push_back({now, live_cost_ms_, live_cells_});
  if (samples_.size() > kMaxSamples) {
    spacing_ *= 2;
    std::deque<Sample> half;
    for (std::size_t i = 0; i < samples_.size(); i += 2) half.push_back(samples_[i]);
    samples_ = std::move(half);
  }
  const auto part = kWindowPart * static_cast<double>((now - samples_.front().time).count());
  const Millis window = std::max(kWindow, Millis(static_cast<std::int64_t>(part)));
  const auto later =
      std::upper_bound(samples_.begin(), samples_.end(), 0, [&](int, const Sample& sample) {
        return now - sample.time < window || live_cells_ - sample.cells < kWindowCells;
      });
  return later == samples_.begin() ? samples_.front() : *std::prev(later);
}

ProgressFigures Estimate::at(Millis now) {
  const Remaining rest = remaining();
  ProgressFigures figures{.cells_resumed = resumed_cells_};
  for (const Depth& depth : depths_) {
    figures.cells_done += depth.done;
    figures.cells_open += depth.open;
  }
  figures.cells_expected = static_cast<double>(figures.cells_done) + rest.cells;
  // Before the first cell workers start, map the scene, build what they search in.
  if (live_cells_ == 0) return figures;

  const Sample& first = since(now);
  const double span_s = static_cast<double>((now - first.time).count()) / 1e3;
  if (now - first.time < kShortest || live_cells_ == first.cells) return figures;
  figures.cells_per_second = static_cast<double>(live_cells_ - first.cells) / span_s;
  const double cost_per_second = (live_cost_ms_ - first.cost_ms) / span_s;
  if (cost_per_second <= 0) return figures;

  figures.eta_s = rest.cost_ms / cost_per_second;
  const double spread = kDeviations * std::sqrt(rest.variance) / cost_per_second;
  figures.eta_low_s = std::max(0.0, figures.eta_s - spread) * (1 - kSpeedError);
  if (rest.unknown_ms <= kUnknownPart * rest.cost_ms)
    figures.eta_high_s = (figures.eta_s + spread) * (1 + kSpeedError);
  return figures;
}

}  // namespace pvsfarm

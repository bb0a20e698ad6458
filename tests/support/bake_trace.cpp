#include "tests/support/bake_trace.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <unordered_map>
#include <unordered_set>

#include "common/base/check.hpp"
#include "common/base/file.hpp"
#include "coordinator/board/board.hpp"

namespace pvsfarm {

namespace {

CellKey key_of(const std::string& cell) {  // "12/5"
  const std::size_t slash = cell.find('/');
  return {static_cast<std::uint32_t>(std::stoul(cell.substr(0, slash))),
          std::stoull(cell.substr(slash + 1))};
}

}  // namespace

Result<TracedBake> read_bake_trace(const std::string& path) {
  Result<std::string> text = read_file(path);
  if (!text) return text.error();
  TracedBake bake;
  bake.finished = text->size() > 3 && text->substr(text->size() - 3) == "\n]\n";
  // As viewers do it: what stands before the last comma at the end of a line is complete.
  if (!bake.finished) *text = text->substr(0, text->rfind(",\n")) + "]";
  const nlohmann::json events = nlohmann::json::parse(*text, nullptr, false);
  if (!events.is_array()) return invalid_input(path + ": not an array of events");
  bake.events = events.size();
  double begin_us = 0;
  for (const nlohmann::json& event : events) {
    if (event["name"] == "begin") {
      bake.root_cells = event["args"]["root_cells"];
      begin_us = event["ts"];
    }
    if (event["ph"] != "X" || !event["args"].contains("cells")) continue;
    const double end_s = (event["ts"].get<double>() + event["dur"].get<double>() - begin_us) / 1e6;
    for (const nlohmann::json& cell : event["args"]["cells"])
      bake.cells.push_back({end_s, key_of(cell["cell"]), cell["cpu_ms"], cell["split"]});
  }
  return bake;
}

Result<TracedBake> read_cell_costs(const std::string& path) {
  const Result<std::string> text = read_file(path);
  if (!text) return text.error();
  TracedBake bake{.finished = true};
  std::istringstream words(*text);
  std::string cell;
  for (TracedCell known; words >> cell >> known.cpu_ms >> known.split;) {
    if (cell.find('/') == std::string::npos) return invalid_input(path + ": no cell: " + cell);
    known.key = key_of(cell);
    bake.root_cells += known.key.is_root() ? 1 : 0;
    bake.cells.push_back(known);
  }
  if (!words.eof()) return invalid_input(path + ": unreadable after " + cell);
  return bake;
}

namespace {

struct VirtualWorker {
  WorkerId id;
  std::deque<BoardTask> tasks;  // the first one runs
  double free_ms = 0;           // since when it does, or since when there is none
};

class VirtualBake {
 public:
  VirtualBake(const VirtualFarm& farm, const TracedBake& bake)
      : board_({.order = TaskOrder::spread(bake.root_cells)}), all_(bake.cells.size()) {
    for (const TracedCell& cell : bake.cells) known_[cell.key] = cell;
    for (std::uint32_t i = 0; i < bake.root_cells; ++i) board_.add({i, 1});
    for (std::size_t i = 0; i < farm.workers; ++i) {
      workers_.push_back({WorkerId{i + 1}, {}, 0});
      board_.join(workers_.back().id, 1);
    }
    done_.root_cells = bake.root_cells;
    done_.finished = true;
  }

  TracedBake run() {
    while (done_.cells.size() < all_) {
      feed();
      const auto next = std::min_element(
          workers_.begin(), workers_.end(),
          [&](const VirtualWorker& a, const VirtualWorker& b) { return end_ms(a) < end_ms(b); });
      PVS_CHECK(!next->tasks.empty());
      now_ms_ = end_ms(*next);
      finish(*next);
    }
    return std::move(done_);
  }

 private:
  Millis now() const { return Millis(std::llround(now_ms_)); }

  double cost_ms(const BoardTask& task) const {
    double cost = 0;
    for (const CellKey& key : task.cells) cost += known_.at(key).cpu_ms;
    return cost;
  }
  double end_ms(const VirtualWorker& worker) const {
    if (worker.tasks.empty()) return std::numeric_limits<double>::infinity();
    return worker.free_ms + cost_ms(worker.tasks.front());
  }

  void feed() {
    for (VirtualWorker& worker : workers_)
      while (std::optional<BoardTask> task = board_.lease(worker.id, now())) {
        if (worker.tasks.empty()) worker.free_ms = std::max(worker.free_ms, now_ms_);
        worker.tasks.push_back(std::move(*task));
      }
  }

  void finish(VirtualWorker& worker) {
    const BoardTask task = std::move(worker.tasks.front());
    worker.tasks.pop_front();
    worker.free_ms = now_ms_;
    for (const CellKey& key : task.cells) {
      TracedCell cell = known_.at(key);
      board_.complete(key, cell.cpu_ms);
      if (!merged_.insert(key).second) continue;  // a copy was there before
      cell.end_s = now_ms_ / 1e3;
      done_.cells.push_back(cell);
      for (int half = 0; cell.split && half < 2; ++half) board_.add(key.child(half));
    }
    board_.finish(task.lease, now());
    drop_superseded();
  }

  // What another has done or has now is not begun; what runs is broken off.
  void drop_superseded() {
    for (const BoardLease lease : board_.take_superseded()) {
      for (VirtualWorker& worker : workers_) {
        const bool ran = !worker.tasks.empty() && worker.tasks.front().lease == lease;
        if (ran) worker.free_ms = now_ms_;
        std::erase_if(worker.tasks, [&](const BoardTask& task) { return task.lease == lease; });
      }
      board_.finish(lease, now());
    }
  }

  Board board_;
  std::size_t all_;
  std::unordered_map<CellKey, TracedCell, CellKeyHash> known_;
  std::unordered_set<CellKey, CellKeyHash> merged_;
  std::vector<VirtualWorker> workers_;
  double now_ms_ = 0;
  TracedBake done_;
};

}  // namespace

TracedBake baked_by(const VirtualFarm& farm, const TracedBake& bake) {
  TracedBake done = VirtualBake(farm, bake).run();
  const double stretch = farm.total_s / done.cells.back().end_s;
  for (TracedCell& cell : done.cells) cell.end_s *= stretch;
  return done;
}

std::vector<EtaSample> replay_estimate(const TracedBake& bake, int samples) {
  Estimate estimate;
  for (std::uint64_t i = 0; i < bake.root_cells; ++i) estimate.opened(0);
  double end_s = 0;
  for (const TracedCell& cell : bake.cells) end_s = std::max(end_s, cell.end_s);
  std::vector<EtaSample> told;
  std::size_t next = 0;
  for (int i = 0; i <= samples; ++i) {
    const double now_s = end_s * i / samples;
    for (; next < bake.cells.size() && bake.cells[next].end_s <= now_s; ++next) {
      const TracedCell& cell = bake.cells[next];
      const int depth = cell.key.depth();
      estimate.done({.depth = depth, .cost_ms = cell.cpu_ms, .split = cell.split});
      for (int half = 0; cell.split && half < 2; ++half) estimate.opened(depth + 1);
    }
    const auto now = Millis(static_cast<std::int64_t>(std::llround(now_s * 1e3)));
    told.push_back({now_s, now_s / end_s, end_s - now_s, estimate.at(now)});
  }
  return told;
}

std::optional<EtaSample> first_beyond(const std::vector<EtaSample>& samples,
                                      const EtaLimits& limits) {
  for (const EtaSample& sample : samples) {
    if (sample.done < limits.from) continue;
    const double total_s = sample.time_s + sample.left_s;
    const double allowed_s = std::max(limits.of_left * sample.left_s, limits.of_total * total_s);
    if (sample.told.eta_s < 0 || std::abs(sample.told.eta_s - sample.left_s) > allowed_s)
      return sample;
  }
  return std::nullopt;
}

}  // namespace pvsfarm

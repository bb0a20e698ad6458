#include "tests/support/bake_trace.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/file.hpp"

namespace pvsfarm {

namespace {
std::uint32_t root_of(const std::string& cell) {  // "12/5"
  return static_cast<std::uint32_t>(std::stoul(cell.substr(0, cell.find('/'))));
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
      bake.cells.push_back(
          {end_s, root_of(cell["cell"]), cell["depth"], cell["cpu_ms"], cell["split"]});
  }
  return bake;
}

TracedBake at_even_speed(TracedBake bake, double total_s) {
  double all_ms = 0, done_ms = 0;
  for (const TracedCell& cell : bake.cells) all_ms += cell.cpu_ms;
  for (TracedCell& cell : bake.cells) {
    done_ms += cell.cpu_ms;
    cell.end_s = total_s * done_ms / all_ms;
  }
  return bake;
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
      estimate.done({.depth = cell.depth, .cost_ms = cell.cpu_ms, .split = cell.split});
      for (int half = 0; cell.split && half < 2; ++half) estimate.opened(cell.depth + 1);
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

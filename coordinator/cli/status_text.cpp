#include "coordinator/cli/status_text.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "coordinator/cli/progress_line.hpp"
#include "coordinator/cli/text.hpp"

namespace pvsfarm {
namespace {

using Json = nlohmann::ordered_json;

double seconds(std::uint64_t ms) { return static_cast<double>(ms) / 1e3; }

Json if_known(double value) { return value >= 0 ? Json(value) : Json(nullptr); }

// Columns as wide as their widest text; the last one is not padded.
std::string table(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i)
      line += "  " + row[i] + std::string(widths[i] - row[i].size(), ' ');
    text += line.substr(0, line.find_last_not_of(' ') + 1) + '\n';
  }
  return text;
}

std::string now_text(const StatusReport::Worker& worker) {
  if (worker.running_cells == 0) return "-";
  std::string text = worker.running;
  if (worker.running_cells > 1) text += " and " + grouped(worker.running_cells - 1) + " more";
  return text + ", " + duration_text(seconds(worker.running_ms));
}

std::string workers_text(const StatusReport& report) {
  if (report.workers.empty()) return "no worker is connected\n";
  std::vector<std::vector<std::string>> rows{
      {"worker", "state", "cells", "computes", "memory", "heard", "failures", "version"}};
  for (const StatusReport::Worker& w : report.workers)
    rows.push_back({w.host + ':' + (w.pid == 0 ? "*" : std::to_string(w.pid)), w.state,
                    grouped(w.cells_done), now_text(w), bytes_text(w.resident_bytes),
                    duration_text(seconds(w.silent_ms)) + " ago", grouped(w.failures), w.build});
  return table(rows);
}

Json json_of(const FarmCounters& c) {
  return {{"tasks", c.tasks},
          {"results", c.results},
          {"duplicates", c.duplicates},
          {"stale", c.stale},
          {"mismatches", c.mismatches},
          {"resends", c.resends},
          {"failed_transient", c.failed_transient},
          {"failed_deterministic", c.failed_deterministic},
          {"failed_resource", c.failed_resource},
          {"leases_expired", c.leases_expired},
          {"workers_joined", c.workers_joined},
          {"workers_lost", c.workers_lost},
          {"workers_refused", c.workers_refused},
          {"commits", c.commits},
          {"splits", c.splits}};
}

Json json_of(const StatusReport::Worker& w) {
  Json json{{"host", w.host},
            {"pid", w.pid},
            {"version", w.build},
            {"state", w.state},
            {"cells_done", w.cells_done},
            {"leases", w.leases},
            {"running", nullptr},
            {"running_cells", w.running_cells},
            {"running_ms", w.running_ms},
            {"silent_ms", w.silent_ms},
            {"connected_ms", w.connected_ms},
            {"resident_bytes", w.resident_bytes},
            {"failures", w.failures}};
  if (w.running_cells > 0) json["running"] = w.running;
  return json;
}

}  // namespace

std::string status_text(const StatusReport& r) {
  std::string text = r.output + ": " + progress_text(r) + '\n';
  const std::uint64_t waiting = r.cells_open - std::min(r.cells_open, r.cells_leased);
  text += grouped(r.cells_done) + " cells done";
  if (r.cells_resumed > 0) text += " (" + grouped(r.cells_resumed) + " from the journal)";
  text += ", " + grouped(r.cells_leased) + " at workers, " + grouped(waiting) + " waiting; " +
          duration_text(seconds(r.elapsed_ms)) + " so far, journal " + bytes_text(r.journal_bytes) +
          '\n';
  text += workers_text(r);
  if (r.cells_quarantined > 0) {
    text += counted(r.cells_quarantined, "cell was", "cells were") + " given up:";
    for (const std::string& name : r.quarantined) text += ' ' + name + ',';
    text.back() = '\n';
  }
  if (!r.last_error.empty()) text += "last trouble: " + r.last_error + '\n';
  return text;
}

std::string status_json(const StatusReport& r) {
  Json workers = Json::array();
  for (const StatusReport::Worker& w : r.workers) workers.push_back(json_of(w));
  const Json json{{"output", r.output},
                  {"state", r.state},
                  {"cells_done", r.cells_done},
                  {"cells_open", r.cells_open},
                  {"cells_leased", r.cells_leased},
                  {"cells_resumed", r.cells_resumed},
                  {"cells_expected", r.cells_expected},
                  {"cells_per_second", r.cells_per_second},
                  {"eta_s", if_known(r.eta_s)},
                  {"eta_low_s", if_known(r.eta_low_s)},
                  {"eta_high_s", if_known(r.eta_high_s)},
                  {"elapsed_ms", r.elapsed_ms},
                  {"result_bytes", r.result_bytes},
                  {"journal_bytes", r.journal_bytes},
                  {"cpu_s", r.cpu_s},
                  {"cells_quarantined", r.cells_quarantined},
                  {"quarantined", r.quarantined},
                  {"last_error", r.last_error},
                  {"counters", json_of(r.counters)},
                  {"workers", workers}};
  // File names need not be UTF-8; JSON must be.
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace pvsfarm

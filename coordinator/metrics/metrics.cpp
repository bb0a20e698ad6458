#include "coordinator/metrics/metrics.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "common/base/check.hpp"

namespace pvsfarm {
namespace {

constexpr Metric kMetrics[] = {
    {"pvsfarm_build_info", "gauge", "1, labelled with the version."},
    {"pvsfarm_state", "gauge", "1 for the state the coordinator is in, 0 for the others."},
    {"pvsfarm_elapsed_seconds", "gauge", "Time since the coordinator began to listen."},
    {"pvsfarm_cells", "gauge", "Cells by where they are now."},
    {"pvsfarm_cells_expected", "gauge", "Cells there will be, splitting included: an estimate."},
    {"pvsfarm_eta_seconds", "gauge", "Time left, estimated; missing while it is not known."},
    {"pvsfarm_eta_low_seconds", "gauge", "Time left, if what is not known yet turns out well."},
    {"pvsfarm_eta_high_seconds", "gauge", "Time left, if what is not known yet turns out badly."},
    {"pvsfarm_cells_resumed", "gauge", "Cells read back from the journal at the start."},
    {"pvsfarm_cells_evaluated_total", "counter", "Cells whose result was merged in this run."},
    {"pvsfarm_cells_split_total", "counter", "Cells that were split into two in this run."},
    {"pvsfarm_cell_cpu_seconds", "histogram", "Processor time of a cell at its worker."},
    {"pvsfarm_tasks_total", "counter", "Tasks handed out."},
    {"pvsfarm_results_total", "counter", "Results of tasks by what became of them."},
    {"pvsfarm_task_failures_total", "counter", "Tasks that workers reported as failed, by kind."},
    {"pvsfarm_leases_expired_total", "counter", "Leases taken back for want of progress."},
    {"pvsfarm_workers", "gauge", "Connected workers by state."},
    {"pvsfarm_workers_joined_total", "counter", "Workers that were greeted."},
    {"pvsfarm_workers_lost_total", "counter", "Workers that went without a good-bye."},
    {"pvsfarm_workers_refused_total", "counter", "Workers that were not let in."},
    {"pvsfarm_workers_resident_bytes", "gauge", "Memory of all workers together."},
    {"pvsfarm_worker_silent_seconds_max", "gauge", "How long the quietest worker has been silent."},
    {"pvsfarm_journal_commits_total", "counter", "Commits to the journal."},
    {"pvsfarm_journal_bytes", "gauge", "Size of the journal on the disk."},
    {"pvsfarm_result_bytes_total", "counter", "Bytes of the sets in merged results."},
    {"process_resident_memory_bytes", "gauge", "Memory of the coordinator."},
    {"process_cpu_seconds_total", "counter", "Processor time of the coordinator."},
    {"process_start_time_seconds", "gauge", "When the coordinator was started, since 1970."},
};

// Writes the metrics in the order of the table, each with its head.
class Writer {
 public:
  void begin(std::string_view name) {
    PVS_CHECK_LT(next_, std::size(kMetrics));
    const Metric& metric = kMetrics[next_++];
    PVS_CHECK(metric.name == name);
    name_ = name;
    text_ += "# HELP " + name_ + ' ' + std::string(metric.help) + "\n# TYPE " + name_ + ' ' +
             std::string(metric.type) + '\n';
  }
  void value(double value, const std::string& labels = "", const char* suffix = "") {
    text_ += name_ + suffix;
    if (!labels.empty()) text_ += '{' + labels + '}';
    text_ += ' ' + number(value) + '\n';
  }
  void value(std::uint64_t value, const std::string& labels = "", const char* suffix = "") {
    text_ += name_ + suffix;
    if (!labels.empty()) text_ += '{' + labels + '}';
    text_ += ' ' + std::to_string(value) + '\n';
  }
  template <class Value>
  void single(std::string_view name, Value v) {
    begin(name);
    value(v);
  }
  void if_known(std::string_view name, double seconds) {
    begin(name);
    if (seconds >= 0) value(seconds);
  }
  std::string finish() {
    PVS_CHECK_EQ(next_, std::size(kMetrics));
    return std::move(text_);
  }
  static std::string number(double value) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.15g", value);
    return text.data();
  }

 private:
  std::string text_, name_;
  std::size_t next_ = 0;
};

std::string label(const char* name, std::string_view value) {
  return std::string(name) + "=\"" + std::string(value) + '"';
}

// `values`: every value that the label can have.
template <std::size_t N>
void put_state(Writer& out, std::string_view state, const std::array<const char*, N>& values) {
  for (const char* value : values) out.value(std::uint64_t{state == value}, label("state", value));
}

void put_cells(Writer& out, const StatusReport& r) {
  const std::uint64_t pending = r.cells_open - std::min(r.cells_open, r.cells_leased);
  out.begin("pvsfarm_cells");
  out.value(r.cells_done, label("state", "done"));
  out.value(r.cells_leased, label("state", "leased"));
  out.value(pending, label("state", "pending"));
  out.value(r.cells_quarantined, label("state", "quarantined"));
  out.single("pvsfarm_cells_expected", r.cells_expected);
  out.if_known("pvsfarm_eta_seconds", r.eta_s);
  out.if_known("pvsfarm_eta_low_seconds", r.eta_low_s);
  out.if_known("pvsfarm_eta_high_seconds", r.eta_high_s);
  out.single("pvsfarm_cells_resumed", r.cells_resumed);
  const std::uint64_t evaluated = r.cells_done - std::min(r.cells_done, r.cells_resumed);
  out.single("pvsfarm_cells_evaluated_total", evaluated);
  out.single("pvsfarm_cells_split_total", r.counters.splits);
}

void put_cell_seconds(Writer& out, const StatusReport& r) {
  out.begin("pvsfarm_cell_cpu_seconds");
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < r.cell_seconds.size(); ++i) {
    sum += r.cell_seconds[i];
    const bool last = i == kCellSecondsBounds.size();
    out.value(sum, label("le", last ? "+Inf" : Writer::number(kCellSecondsBounds[i])), "_bucket");
  }
  out.value(r.cpu_s, "", "_sum");
  out.value(sum, "", "_count");
}

void put_exchange(Writer& out, const FarmCounters& c) {
  out.single("pvsfarm_tasks_total", c.tasks);
  out.begin("pvsfarm_results_total");
  const std::uint64_t others = c.duplicates + c.stale + c.mismatches;
  out.value(c.results - std::min(c.results, others), label("outcome", "merged"));
  out.value(c.duplicates, label("outcome", "duplicate"));
  out.value(c.stale, label("outcome", "stale"));
  out.value(c.mismatches, label("outcome", "mismatch"));
  out.value(c.resends, label("outcome", "resend"));
  out.begin("pvsfarm_task_failures_total");
  out.value(c.failed_transient, label("kind", "transient"));
  out.value(c.failed_deterministic, label("kind", "deterministic"));
  out.value(c.failed_resource, label("kind", "resource"));
  out.single("pvsfarm_leases_expired_total", c.leases_expired);
}

void put_workers(Writer& out, const StatusReport& r) {
  constexpr std::array<const char*, 6> kStates{"computing", "idle",    "preparing",
                                               "draining",  "suspect", "blocked"};
  std::array<std::uint64_t, kStates.size()> counts{};
  std::uint64_t resident_bytes = 0, silent_ms = 0;
  for (const StatusReport::Worker& worker : r.workers) {
    for (std::size_t i = 0; i < kStates.size(); ++i) counts[i] += worker.state == kStates[i];
    resident_bytes += worker.resident_bytes;
    silent_ms = std::max(silent_ms, worker.silent_ms);
  }
  out.begin("pvsfarm_workers");
  for (std::size_t i = 0; i < kStates.size(); ++i) out.value(counts[i], label("state", kStates[i]));
  out.single("pvsfarm_workers_joined_total", r.counters.workers_joined);
  out.single("pvsfarm_workers_lost_total", r.counters.workers_lost);
  out.single("pvsfarm_workers_refused_total", r.counters.workers_refused);
  out.single("pvsfarm_workers_resident_bytes", resident_bytes);
  out.single("pvsfarm_worker_silent_seconds_max", static_cast<double>(silent_ms) / 1e3);
}

}  // namespace

std::span<const Metric> all_metrics() { return kMetrics; }

std::string metrics_text(const StatusReport& report, const ProcessFigures& process) {
  Writer out;
  out.begin("pvsfarm_build_info");
  out.value(std::uint64_t{1}, label("version", PVSFARM_VERSION));
  out.begin("pvsfarm_state");
  put_state(out, report.state,
            std::array{"starting", "running", "paused", "draining", "disk full", "writing"});
  out.single("pvsfarm_elapsed_seconds", static_cast<double>(report.elapsed_ms) / 1e3);
  put_cells(out, report);
  put_cell_seconds(out, report);
  put_exchange(out, report.counters);
  put_workers(out, report);
  out.single("pvsfarm_journal_commits_total", report.counters.commits);
  out.single("pvsfarm_journal_bytes", report.journal_bytes);
  out.single("pvsfarm_result_bytes_total", report.result_bytes);
  out.single("process_resident_memory_bytes", process.resident_bytes);
  out.single("process_cpu_seconds_total", process.cpu_s);
  out.single("process_start_time_seconds", process.start_time_s);
  return out.finish();
}

}  // namespace pvsfarm

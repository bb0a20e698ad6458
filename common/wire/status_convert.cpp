// STATUS to and from Protobuf, as pack.cpp and unpack.cpp do it for the other messages.
#include <algorithm>

#include "common/wire/convert.hpp"

namespace pvsfarm {
namespace {

// Of a worker's own texts: a status of kMaxReportedWorkers must fit a message.
constexpr std::size_t kMaxHostBytes = 64, kMaxBuildBytes = 48, kMaxNameBytes = 40;

Error refused(const char* what) { return invalid_input(std::string("message refused: ") + what); }

bool copy_text(const std::string& from, std::string& to) {
  if (from.size() > kMaxTextBytes) return false;
  to = from;
  return true;
}

std::string text_of(const std::string& text) { return text.substr(0, kMaxTextBytes); }

void pack_counters(const FarmCounters& plain, proto::FarmCounters& message) {
  message.set_tasks(plain.tasks);
  message.set_results(plain.results);
  message.set_duplicates(plain.duplicates);
  message.set_stale(plain.stale);
  message.set_mismatches(plain.mismatches);
  message.set_resends(plain.resends);
  message.set_failed_transient(plain.failed_transient);
  message.set_failed_deterministic(plain.failed_deterministic);
  message.set_failed_resource(plain.failed_resource);
  message.set_leases_expired(plain.leases_expired);
  message.set_workers_joined(plain.workers_joined);
  message.set_workers_lost(plain.workers_lost);
  message.set_workers_refused(plain.workers_refused);
  message.set_commits(plain.commits);
  message.set_splits(plain.splits);
}

bool unpack_worker(const proto::StatusReport::Worker& in, StatusReport::Worker& out) {
  out.pid = in.pid();
  out.cells_done = in.cells_done();
  out.leases = in.leases();
  out.silent_ms = in.silent_ms();
  out.resident_bytes = in.resident_bytes();
  out.running_cells = in.running_cells();
  out.running_ms = in.running_ms();
  out.connected_ms = in.connected_ms();
  out.failures = in.failures();
  out.number = in.number();
  return copy_text(in.host(), out.host) && copy_text(in.build(), out.build) &&
         copy_text(in.state(), out.state) && copy_text(in.running(), out.running);
}

void unpack_counters(const proto::FarmCounters& in, FarmCounters& out) {
  out = {.tasks = in.tasks(),
         .results = in.results(),
         .duplicates = in.duplicates(),
         .stale = in.stale(),
         .mismatches = in.mismatches(),
         .resends = in.resends(),
         .failed_transient = in.failed_transient(),
         .failed_deterministic = in.failed_deterministic(),
         .failed_resource = in.failed_resource(),
         .leases_expired = in.leases_expired(),
         .workers_joined = in.workers_joined(),
         .workers_lost = in.workers_lost(),
         .workers_refused = in.workers_refused(),
         .commits = in.commits(),
         .splits = in.splits()};
}

}  // namespace

void pack(const StatusReport& plain, proto::StatusReport& message) {
  message.set_output(text_of(plain.output));
  message.set_state(text_of(plain.state));
  message.set_cells_done(plain.cells_done);
  message.set_cells_open(plain.cells_open);
  message.set_cells_expected(plain.cells_expected);
  message.set_cells_per_second(plain.cells_per_second);
  message.set_eta_s(plain.eta_s);
  message.set_result_bytes(plain.result_bytes);
  message.set_elapsed_ms(plain.elapsed_ms);
  message.set_last_error(text_of(plain.last_error));
  const std::size_t count = std::min(plain.workers.size(), kMaxReportedWorkers);
  for (std::size_t i = 0; i < count; ++i) {
    const StatusReport::Worker& worker = plain.workers[i];
    proto::StatusReport::Worker& out = *message.add_workers();
    out.set_host(worker.host.substr(0, kMaxHostBytes));
    out.set_pid(worker.pid);
    out.set_cells_done(worker.cells_done);
    out.set_leases(worker.leases);
    out.set_silent_ms(worker.silent_ms);
    out.set_resident_bytes(worker.resident_bytes);
    out.set_build(worker.build.substr(0, kMaxBuildBytes));
    out.set_state(worker.state.substr(0, kMaxNameBytes));
    out.set_running(worker.running.substr(0, kMaxNameBytes));
    out.set_running_cells(worker.running_cells);
    out.set_running_ms(worker.running_ms);
    out.set_connected_ms(worker.connected_ms);
    out.set_failures(worker.failures);
    out.set_number(worker.number);
  }
  message.set_cells_leased(plain.cells_leased);
  message.set_cells_resumed(plain.cells_resumed);
  message.set_cells_quarantined(plain.cells_quarantined);
  const std::size_t named = std::min(plain.quarantined.size(), kMaxNamedCells);
  for (std::size_t i = 0; i < named; ++i)
    message.add_quarantined(plain.quarantined[i].substr(0, kMaxNameBytes));
  message.set_journal_bytes(plain.journal_bytes);
  message.set_eta_low_s(plain.eta_low_s);
  message.set_eta_high_s(plain.eta_high_s);
  pack_counters(plain.counters, *message.mutable_counters());
  for (const std::uint64_t cells : plain.cell_seconds) message.add_cell_seconds(cells);
  message.set_cpu_s(plain.cpu_s);
  message.set_resident_bytes(plain.resident_bytes);
}

Status unpack(const proto::StatusReport& in, StatusReport& out) {
  if (!copy_text(in.output(), out.output) || !copy_text(in.state(), out.state) ||
      !copy_text(in.last_error(), out.last_error))
    return refused("STATUS with a text too long");
  if (static_cast<std::size_t>(in.workers_size()) > kMaxReportedWorkers)
    return refused("STATUS with too many workers");
  out.cells_done = in.cells_done();
  out.cells_open = in.cells_open();
  out.cells_expected = in.cells_expected();
  out.cells_per_second = in.cells_per_second();
  out.eta_s = in.eta_s();
  out.result_bytes = in.result_bytes();
  out.elapsed_ms = in.elapsed_ms();
  for (const proto::StatusReport::Worker& worker : in.workers())
    if (!unpack_worker(worker, out.workers.emplace_back()))
      return refused("STATUS with a text too long");
  out.cells_leased = in.cells_leased();
  out.cells_resumed = in.cells_resumed();
  out.cells_quarantined = in.cells_quarantined();
  if (static_cast<std::size_t>(in.quarantined_size()) > kMaxNamedCells)
    return refused("STATUS with too many names");
  for (const std::string& name : in.quarantined())
    if (!copy_text(name, out.quarantined.emplace_back()))
      return refused("STATUS with a text too long");
  out.journal_bytes = in.journal_bytes();
  out.eta_low_s = in.eta_low_s();
  out.eta_high_s = in.eta_high_s();
  unpack_counters(in.counters(), out.counters);
  const auto classes = static_cast<std::size_t>(in.cell_seconds_size());
  if (classes != 0 && classes != out.cell_seconds.size())
    return refused("STATUS with other classes of cells");
  for (std::size_t i = 0; i < classes; ++i)
    out.cell_seconds[i] = in.cell_seconds(static_cast<int>(i));
  out.cpu_s = in.cpu_s();
  out.resident_bytes = in.resident_bytes();
  return {};
}

}  // namespace pvsfarm

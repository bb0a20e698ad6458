// What a desk tells of itself: the status, the counters, the events; and what it is asked to do.
#include <algorithm>

#include "coordinator/service/desk.hpp"

namespace pvsfarm {
namespace {
constexpr std::size_t kMaxNews = 1000;  // waiting to be logged
}

std::vector<std::string> Desk::take_warnings() {
  std::vector<std::string> texts;
  for (LogEvent& news : take_news())
    if (news.level >= LogLevel::kWarning) texts.push_back(std::move(news.text));
  return texts;
}

void Desk::on_control(ControlKind kind, Millis now) {
  switch (kind) {
    case ControlKind::kDrain:
      drain_asked_ = true;
      return;
    case ControlKind::kCancel:
      cancel_asked_ = true;
      return;
    case ControlKind::kPause:
      if (!paused_since_) tell({.event = "paused", .text = "paused: what runs is finished"});
      if (!paused_since_) paused_since_ = now;
      return;
    case ControlKind::kResume:
      if (!paused_since_) return;
      tell({.event = "resumed", .text = "resumed"});
      paused_ += now - *paused_since_;
      paused_since_.reset();
      for (const auto& [worker, peer] : peers_) hungry_.insert(peer);
      return;
  }
}

void Desk::tell(LogEvent news) {
  if (news_.size() < kMaxNews) news_.push_back(std::move(news));
}

void Desk::warn(std::string event, std::string text, const Session* session, BoardLease lease,
                std::string cell) {
  last_error_ = text;
  tell({.level = LogLevel::kWarning,
        .event = std::move(event),
        .text = std::move(text),
        .worker = session == nullptr ? "" : worker_name(session->hello),
        .cell = std::move(cell),
        .lease = static_cast<std::uint64_t>(lease)});
}

void Desk::count_done(const WorkAnswer& answer) {
  for (const WorkAnswer::Done& done : answer.done) {
    const double cpu_s = done.cost_ms / 1e3;
    const auto bound =
        std::lower_bound(kCellSecondsBounds.begin(), kCellSecondsBounds.end(), cpu_s);
    ++cell_seconds_[static_cast<std::size_t>(bound - kCellSecondsBounds.begin())];
    cpu_s_ += cpu_s;
    if (done.split) ++counters_.splits;
  }
  ++counters_.results;
  if (answer.outcome == ResultOutcome::kDuplicate) ++counters_.duplicates;
  if (answer.outcome == ResultOutcome::kStale) ++counters_.stale;
  if (answer.outcome == ResultOutcome::kMismatch) ++counters_.mismatches;
}

void Desk::end_task(Session& session, BoardLease lease, FarmEvents::End end, Millis now,
                    std::span<const WorkAnswer::Done> done, const std::string& text) {
  const auto at = std::find_if(session.tasks.begin(), session.tasks.end(),
                               [&](const Session::Given& given) { return given.lease == lease; });
  if (at != session.tasks.end()) {
    const bool ran = at == session.tasks.begin();
    session.tasks.erase(at);
    if (ran && !session.tasks.empty()) session.tasks.front().since = now;
  }
  if (settings_.events != nullptr) settings_.events->task_ended(lease, end, done, text);
}

void Desk::tell_queue() const {
  if (settings_.events != nullptr)
    settings_.events->queue({board_.pending_count(), board_.leased_count(), sessions_.size()});
}

StatusReport::Worker Desk::worker_status(const Session& session, Millis now) const {
  const auto since = [&](Millis then) { return static_cast<std::uint64_t>((now - then).count()); };
  StatusReport::Worker worker{.host = session.hello.host,
                              .pid = session.hello.pid,
                              .cells_done = session.cells_done,
                              .silent_ms = since(session.heard),
                              .resident_bytes = session.resident_bytes,
                              .build = session.hello.build};
  worker.leases = static_cast<std::uint32_t>(board_.lease_count(session.worker));
  worker.connected_ms = since(session.joined);
  worker.failures = session.failures;
  worker.number = session.token;
  worker.state = now - session.heard > settings_.limits.suspect ? "suspect"
                 : session.draining                             ? "draining"
                 : !session.ready                               ? "preparing"
                 : session.tasks.empty()                        ? "idle"
                                                                : "computing";
  if (session.tasks.empty()) return worker;
  const Session::Given& running = session.tasks.front();
  worker.running = work_.name_of(running.first);
  worker.running_cells = running.cells;
  worker.running_ms = since(running.since);
  return worker;
}

StatusReport Desk::status(Millis now) {
  // Time spent paused says nothing about speed.
  const Millis stood = paused_ + (paused_since_ ? now - *paused_since_ : Millis(0));
  const WorkProgress progress = work_.progress(now - stood);
  const ProgressFigures& figures = progress.figures;
  StatusReport report{.output = settings_.output,
                      .state = !leasing_           ? "draining"
                               : work_.disk_full() ? "disk full"
                               : paused_since_     ? "paused"
                                                   : "running",
                      .cells_done = figures.cells_done,
                      .cells_open = figures.cells_open,
                      .cells_expected = figures.cells_expected,
                      .cells_per_second = figures.cells_per_second,
                      .eta_s = figures.eta_s,
                      .result_bytes = progress.result_bytes,
                      .elapsed_ms = static_cast<std::uint64_t>((now - start_).count()),
                      .last_error = last_error_,
                      .cells_leased = board_.leased_count(),
                      .cells_resumed = figures.cells_resumed,
                      .cells_quarantined = progress.given_up_count,
                      .journal_bytes = progress.journal_bytes,
                      .eta_low_s = figures.eta_low_s,
                      .eta_high_s = figures.eta_high_s,
                      .counters = counters_,
                      .cell_seconds = cell_seconds_,
                      .cpu_s = cpu_s_};
  for (const CellKey& key : progress.given_up) report.quarantined.push_back(work_.name_of(key));
  for (const auto& [worker, peer] : peers_)
    report.workers.push_back(worker_status(sessions_.at(peer), now));
  for (const auto& [worker, block] : blocked_workers_)
    if (!block.was.host.empty()) report.workers.push_back(block.was);
  for (const auto& [machine, block] : blocked_machines_) report.workers.push_back(block.was);
  return report;
}

}  // namespace pvsfarm

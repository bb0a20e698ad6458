// Heartbeats, tasks for whoever has room for them, and who gets none any more.
#include <algorithm>

#include "coordinator/service/desk.hpp"

namespace pvsfarm {
namespace {
constexpr Millis kSpareLookEvery{50};  // for stragglers
}

Status Desk::on_heartbeat(const std::string& peer, Session& session, const Heartbeat& beat,
                          Millis now) {
  session.resident_bytes = beat.resident_bytes;
  HeartbeatAck ack;
  std::set<BoardLease> still;
  for (const Heartbeat::Running& running : beat.running) {
    const BoardLease id = board_id(running.lease);
    if (!running.cells.empty() && leasing_ && work_.adopts() && !board_.holder(id))
      if (board_.adopt(session.worker, id, running.cells, now))
        session.tasks.push_back(
            {id, running.cells.front(), static_cast<std::uint32_t>(running.cells.size()), now});
    const bool renewed =
        board_.holder(id) == session.worker &&
        (running.progress >= kProgressComputed ? board_.renew_computed(id, now)
                                               : board_.renew(id, running.progress, now));
    still.insert(id);
    (renewed ? ack.renewed : ack.cancelled).push_back(running.lease);
  }
  reply(peer, std::move(ack));
  session.sent = now;
  board_.release_expired(session.worker, still);
  session.ready = beat.ready;
  return hand_out(peer, session, now);
}

void Desk::on_failed(Session& session, const TaskFailed& failed, Millis now) {
  const BoardLease id = board_id(failed.lease);
  if (board_.holder(id) != session.worker) return;
  warn("task_failed", worker_name(session.hello) + ": " + failed.text, &session, id);
  ++(failed.kind == FailureKind::kDeterministic ? counters_.failed_deterministic
     : failed.kind == FailureKind::kResource    ? counters_.failed_resource
                                                : counters_.failed_transient);
  ++session.failures;
  Board::Failure failure = Board::Failure::kTransient;
  if (failed.kind == FailureKind::kDeterministic) failure = Board::Failure::kDeterministic;
  if (failed.kind == FailureKind::kResource) failure = Board::Failure::kResource;
  board_.fail(id, failure, now);
  end_task(session, id, FarmEvents::End::kFailed, now, {}, failed.text);
}

Status Desk::hand_out(const std::string& peer, Session& session, Millis now) {
  if (!giving() || !session.ready || now - session.heard > settings_.limits.suspect) return {};
  const auto together = [&](const CellKey& first, const CellKey& next) {
    return work_.together(first, next);
  };
  while (const std::optional<BoardTask> task = board_.lease(session.worker, now, together)) {
    owners_.given(task->lease, session.worker);
    Result<Message> message = work_.task(*task, shelf_);
    if (!message) return message.error();
    reply(peer, std::move(message).value());
    session.sent = now;
    session.tasks.push_back(
        {task->lease, task->cells.front(), static_cast<std::uint32_t>(task->cells.size()), now});
    ++counters_.tasks;
    if (settings_.events != nullptr) settings_.events->task_given(session.worker, *task);
  }
  tell_queue();
  if (board_.fresh_count() == 0) hungry_.insert(peer);
  return {};
}

// For those that came when there was nothing: what was opened since, what may be tried again, and
// what others are late with.
Status Desk::feed_hungry(Millis now) {
  if (!giving()) return {};
  while (board_.fresh_count() > 0 && !hungry_.empty()) {
    const std::string peer = *hungry_.begin();
    hungry_.erase(hungry_.begin());
    if (Status status = hand_out(peer, sessions_.at(peer), now); !status) return status;
  }
  if (hungry_.empty() || now < next_spare_look_) return {};
  next_spare_look_ = now + kSpareLookEvery;
  for (const std::string& peer : std::vector<std::string>(hungry_.begin(), hungry_.end())) {
    Session& session = sessions_.at(peer);
    if (board_.lease_count(session.worker) > 0) continue;
    if (Status status = hand_out(peer, session, now); !status) return status;
    // Nobody is late: what one idle worker does not get, no other does.
    if (board_.lease_count(session.worker) == 0 && board_.pending_count() == 0) return {};
  }
  return {};
}

void Desk::cancel_superseded() {
  for (const BoardLease lease : board_.take_superseded())
    if (const std::optional<WorkerId> worker = board_.holder(lease)) {
      const std::string& peer = peers_.at(*worker);
      reply(peer, Cancel{{wire_id(lease)}});
      end_task(sessions_.at(peer), lease, FarmEvents::End::kReturned, ticked_);
    }
}

void Desk::turn_out_blocked() {
  for (const Board::Blocked& blocked : board_.take_blocked()) {
    const std::string cells = std::to_string(blocked.cells) + " cells";
    turn_out(blocked, blocked.worker ? "blocked: " + cells + " failed on this worker, see its log"
                                     : "blocked: workers of this machine crashed at " + cells +
                                           ", one after the other, and completed none in between");
  }
  for (const WorkAnswer::Wrong& wrong : std::exchange(wrong_, {}))
    turn_out({.worker = wrong.worker},
             "blocked: its result of " + work_.name_of(wrong.key) +
                 " is not what two others computed; audit what else it computed");
}

void Desk::turn_out(const Board::Blocked& whom, const std::string& text) {
  Block block{text, {.state = "blocked"}};
  for (const auto& [host, machine] : machines_)
    if (machine == whom.machine && !whom.worker) block.was.host = host;
  std::vector<std::string> out;
  for (const auto& [peer, session] : sessions_) {
    if (whom.worker ? session.worker != *whom.worker : session.machine != whom.machine) continue;
    out.push_back(peer);
    if (!whom.worker) continue;
    block.was.host = session.hello.host;
    block.was.pid = session.hello.pid;
    block.was.build = session.hello.build;
    block.was.cells_done = session.cells_done;
    block.was.failures = session.failures;
  }
  if (whom.worker)
    blocked_workers_.try_emplace(*whom.worker, std::move(block));
  else
    blocked_machines_.try_emplace(whom.machine, std::move(block));
  for (const std::string& peer : out) {
    const Hello hello = sessions_.at(peer).hello;
    warn("worker_blocked", worker_name(hello) + " " + text, &sessions_.at(peer));
    reject(peer, blocked_code(hello), text);
    drop(peer, Board::Parting::kGraceful, ticked_);
  }
}

// The deadline has passed: nothing more is given away, what runs is called back, and what its
// workers have of it so far is awaited for a moment.
void Desk::cut_off(Millis now) {
  cut_off_at_ = now + settings_.limits.cut_off;
  leasing_ = false;
  for (const BoardLease lease : board_.clear())
    reply(peers_.at(*board_.holder(lease)), Cancel{{wire_id(lease)}});
}

}  // namespace pvsfarm

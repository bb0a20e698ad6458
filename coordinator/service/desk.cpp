#include "coordinator/service/desk.hpp"

#include <algorithm>
#include <utility>

#include "common/base/check.hpp"

namespace pvsfarm {
namespace {

constexpr std::size_t kMaxIdentities = 64 * 1024;  // then those that left are forgotten

// No other coordinator uses these numbers: results of its predecessor may still arrive.
std::uint64_t first_lease(std::uint64_t epoch) { return (epoch & 0xffffffff) << 32 | 1; }

}  // namespace

static_assert(BoardLimits{}.task_cells <= kMaxTaskCells);

Desk::Desk(DeskSettings settings, Work& work, Millis now)
    : settings_(std::move(settings)),
      work_(work),
      board_(settings_.limits.board, first_lease(settings_.epoch)),
      owners_(first_lease(settings_.epoch)),
      start_(now),
      ticked_(now),
      credit_(settings_.limits.incoming_bytes) {
  open_more();
}

void Desk::open_more() {
  if (cut_off_at_) return;
  for (const CellKey& key : work_.take_open(board_.pending_count())) board_.add(key);
}

bool Desk::done() const {
  return board_.idle() && work_.uncommitted() == 0 && (!cut_off_at_ || ticked_ >= *cut_off_at_);
}

void Desk::reply(const std::string& peer, Message message) {
  Envelope envelope{.epoch = settings_.epoch};
  const auto session = sessions_.find(peer);
  if (session != sessions_.end()) {
    envelope.session = session->second.token;
    envelope.minor = session->second.minor;
  }
  outgoing_.push_back({peer, envelope, std::move(message)});
}

void Desk::reject(const std::string& peer, RejectCode code, std::string text) {
  reply(peer, Reject{code, std::move(text)});
}

void Desk::drop(const std::string& peer, Board::Parting parting, Millis now) {
  const auto found = sessions_.find(peer);
  if (found == sessions_.end()) return;
  Session& session = found->second;
  forget_incoming(session);
  blobs_arrived(session, 0);
  board_.leave(session.worker, parting, now);
  while (!session.tasks.empty())
    end_task(session, session.tasks.back().lease, FarmEvents::End::kReturned, now);
  const bool lost = parting == Board::Parting::kLost;
  if (lost) ++counters_.workers_lost;
  if (settings_.events != nullptr) settings_.events->worker_left(session.worker, lost);
  const std::string name = worker_name(session.hello);
  tell({.event = "worker_left", .text = name + (lost ? " is lost" : " has left"), .worker = name});
  peers_.erase(session.worker);
  hungry_.erase(peer);
  sessions_.erase(found);
}

void Desk::gone(const std::string& peer) {
  const auto found = sessions_.find(peer);
  if (found == sessions_.end()) return;
  if (board_.lease_count(found->second.worker) > 0)
    warn("worker_lost",
         worker_name(found->second.hello) + ": connection lost; its cells go to others",
         &found->second);
  drop(peer, Board::Parting::kLost, ticked_);
}

void Desk::worker_exited(std::uint32_t pid) {
  for (const auto& [peer, session] : sessions_)
    if (session.hello.pid == pid) return gone(std::string(peer));
}

Status Desk::receive(const std::string& peer, const Result<Decoded>& decoded, Millis now,
                     Role role) {
  if (!decoded) {
    reject(peer, RejectCode::kBadMessage, decoded.error().text);
    warn("peer_dropped", "peer dropped: " + decoded.error().text);
    drop(peer, Board::Parting::kLost, now);
    return {};
  }
  const Message& message = decoded->message;
  if (!permits(role, message)) {
    const std::string text = std::string("a key of role ") + std::string(role_name(role)) +
                             " may not send " + type_name(message);
    reject(peer, RejectCode::kForbidden, text);
    warn("peer_refused", "peer refused: " + text);
    return {};
  }
  if (const auto* hello = std::get_if<Hello>(&message)) {
    on_hello(peer, *hello, now);
    return {};
  }
  if (std::holds_alternative<StatusGet>(message)) {
    reply(peer, status(now));
    return {};
  }
  if (const auto* control = std::get_if<Control>(&message)) {
    on_control(control->kind, now);
    reply(peer, ControlAck{});
    return {};
  }
  const auto found = sessions_.find(peer);
  if (found == sessions_.end() || decoded->envelope.session != found->second.token ||
      decoded->envelope.epoch != settings_.epoch) {
    reject(peer, RejectCode::kUnknownSession, "no such session; say HELLO");
    return {};
  }
  found->second.heard = now;
  return dispatch(peer, found->second, message, now);
}

// What stands against a worker, naming both values; "" for nothing.
std::string Desk::refusal(const Hello& hello, RejectCode& code) const {
  code = RejectCode::kProtocol;
  if (hello.major != kProtocolMajor || hello.minor_lowest > kProtocolMinorHighest ||
      hello.minor_highest < kProtocolMinorLowest) {
    const auto range = [](std::uint32_t major, std::uint32_t low, std::uint32_t high) {
      return std::to_string(major) + "." + std::to_string(low) + " to " + std::to_string(major) +
             "." + std::to_string(high);
    };
    return "protocol: the worker speaks " +
           range(hello.major, hello.minor_lowest, hello.minor_highest) + ", the coordinator " +
           range(kProtocolMajor, kProtocolMinorLowest, kProtocolMinorHighest);
  }
  code = RejectCode::kKernel;
  const std::string theirs = describe(hello.kernel, settings_.evaluator);
  const std::string ours =
      settings_.pinned_kernel.empty()
          ? describe({settings_.algorithm_version, hello.kernel.mesa_version}, settings_.evaluator)
          : settings_.pinned_kernel;
  if (theirs != ours)
    return "kernel: the worker has " + theirs + ", this bake needs " + ours +
           "; run the pvsfarm-worker of the coordinator's release";
  code = blocked_code(hello);
  if (std::string text = block_of(hello); !text.empty()) return text;
  code = RejectCode::kFull;
  if (sessions_.size() >= settings_.limits.sessions)
    return "the coordinator has its limit of " + std::to_string(sessions_.size()) + " workers";
  return "";
}

std::string Desk::block_of(const Hello& hello) const {
  if (const auto worker = identities_.find(hello.worker); worker != identities_.end())
    if (const auto block = blocked_workers_.find(worker->second); block != blocked_workers_.end())
      return block->second.why;
  if (const auto machine = machines_.find(hello.host); machine != machines_.end())
    if (const auto block = blocked_machines_.find(machine->second);
        block != blocked_machines_.end())
      return block->second.why;
  return "";
}

// What makes a worker end and not be started again, in words that it knows.
RejectCode Desk::blocked_code(const Hello& hello) {
  return hello.minor_highest >= kMinorWithCredit ? RejectCode::kBlocked : RejectCode::kBadResult;
}

WorkerId Desk::identity_of(const Hello& hello) {
  if (identities_.size() >= kMaxIdentities)
    std::erase_if(identities_, [&](const auto& known) {
      return peers_.count(known.second) == 0 && blocked_workers_.count(known.second) == 0;
    });
  const auto [at, fresh] = identities_.try_emplace(hello.worker, WorkerId{last_worker_ + 1});
  if (fresh) ++last_worker_;
  return at->second;
}

void Desk::on_hello(const std::string& peer, const Hello& hello, Millis now) {
  // A worker that says HELLO again has forgotten its tasks, or lost its connection.
  drop(peer, Board::Parting::kGraceful, now);
  if (const auto known = identities_.find(hello.worker); known != identities_.end())
    if (const auto other = peers_.find(known->second); other != peers_.end())
      drop(std::string(other->second), Board::Parting::kGraceful, now);
  RejectCode code{};
  if (const std::string text = refusal(hello, code); !text.empty()) {
    reject(peer, code, text);
    ++counters_.workers_refused;
    warn("worker_refused", worker_name(hello) + " refused: " + text);
    return;
  }
  if (settings_.pinned_kernel.empty())
    settings_.pinned_kernel = describe(hello.kernel, settings_.evaluator);
  kernel_id_ = kernel_id(hello.kernel, settings_.evaluator, settings_.scene_digest);

  Session session{.worker = identity_of(hello), .token = ++last_token_, .hello = hello};
  const MachineId next_machine{machines_.size() + 1};
  session.machine = machines_.try_emplace(hello.host, next_machine).first->second;
  session.minor = std::min(hello.minor_highest, kProtocolMinorHighest);
  session.heard = session.sent = session.joined = now;
  ++counters_.workers_joined;
  if (settings_.events != nullptr) settings_.events->worker_joined(session.worker, hello);
  tell({.event = "worker_joined",
        .text = worker_name(hello) + " has joined, " + hello.build,
        .worker = worker_name(hello)});
  board_.join(session.worker, hello.slots, session.machine);
  peers_[session.worker] = peer;
  sessions_[peer] = std::move(session);
  reply(peer, Welcome{sessions_[peer].minor, settings_.evaluator, settings_.scene_digest,
                      settings_.scene.size(), settings_.scene_path, kernel_id_,
                      static_cast<std::uint32_t>(settings_.limits.heartbeat.count())});
}

Status Desk::dispatch(const std::string& peer, Session& session, const Message& message,
                      Millis now) {
  if (const auto* beat = std::get_if<Heartbeat>(&message)) {
    return on_heartbeat(peer, session, *beat, now);
  } else if (const auto* begin = std::get_if<ResultBegin>(&message)) {
    if (!foreign(peer, session, begin->lease, now))
      on_begin(session, begin->lease, begin->bytes, *begin, now);
  } else if (const auto* finding = std::get_if<FindingBegin>(&message)) {
    if (!foreign(peer, session, finding->lease, now))
      on_begin(session, finding->lease, finding->bytes, *finding, now);
  } else if (const auto* chunk = std::get_if<ResultChunk>(&message)) {
    on_chunk(peer, session, *chunk, now);
  } else if (const auto* end = std::get_if<ResultEnd>(&message)) {
    return on_end(peer, session, *end, now);
  } else if (const auto* failed = std::get_if<TaskFailed>(&message)) {
    on_failed(session, *failed, now);
    turn_out_blocked();
    const auto still = sessions_.find(peer);
    return still == sessions_.end() ? Status{} : hand_out(peer, still->second, now);
  } else if (const auto* get = std::get_if<BlobGet>(&message)) {
    on_blob_get(peer, session, *get, now);
  } else if (std::holds_alternative<Draining>(message)) {
    board_.stop_leasing(session.worker);
    session.draining = true;
  } else if (std::holds_alternative<Bye>(message)) {
    drop(peer, Board::Parting::kGraceful, now);
  } else {
    reject(peer, RejectCode::kBadMessage, "not a message for a coordinator");
    drop(peer, Board::Parting::kLost, now);
  }
  return {};
}

// While the disk is full, nothing is begun or acknowledged, and workers keep what they have: they
// are only told that we live.
Status Desk::commit(Millis now) {
  const bool was_full = work_.disk_full();
  if (was_full && now < commit_again_) return {};
  if (settings_.events != nullptr) settings_.events->commit_begins(work_.uncommitted());
  if (Status status = work_.commit(); !status) return status;
  if (settings_.events != nullptr) settings_.events->commit_ends();
  if (!work_.disk_full()) ++counters_.commits;
  commit_again_ = now + settings_.limits.disk_full_retry;
  if (was_full && !work_.disk_full())
    for (const auto& [peer, session] : sessions_) hungry_.insert(peer);
  if (work_.disk_full() != was_full)
    warn(was_full ? "disk_has_room" : "disk_full",
         was_full ? "the disk has room again: going on"
                  : "the disk is full: no cell is begun or acknowledged until there is room for "
                    "the journal beside the output; free some, nothing is lost");
  return {};
}

Status Desk::commit_if_due(Millis now) {
  const std::size_t rows = work_.uncommitted();
  if (rows > 0 && (rows >= settings_.limits.commit_rows || board_.idle() ||
                   now - oldest_uncommitted_ >= settings_.limits.commit_delay)) {
    if (Status status = commit(now); !status) return status;
  }
  if (work_.uncommitted() > 0) return {};
  for (PendingAck& ack : std::exchange(acks_, {})) reply(ack.peer, ack.ack);
  return {};
}

void Desk::look_after_sessions(Millis now) {
  const DeskLimits& limits = settings_.limits;
  if (now < next_session_look_) return;
  next_session_look_ = now + limits.heartbeat / 8;
  std::vector<std::string> lost;
  for (auto& [peer, session] : sessions_) {
    const Millis silent = now - session.heard;
    if (silent > limits.lost) {
      lost.push_back(peer);
    } else if (silent > 3 * limits.heartbeat / 2 && now - session.sent >= limits.heartbeat / 2) {
      // To a connection that is gone this fails at once, long before the leases run out.
      reply(peer, HeartbeatAck{});
      session.sent = now;
    }
    if (session.incoming && session.incoming->granted > 0 && !work_.disk_full() &&
        now - session.incoming->touched > limits.upload_stalls)
      forget_incoming(session);  // its END is answered with a wish for all of it
  }
  for (const std::string& peer : lost) gone(peer);
  forget_blobs(now);
}

Status Desk::tick(Millis now) {
  ticked_ = now;
  for (const BoardLease lease : board_.expire(now)) {
    const std::string& peer = peers_.at(*board_.holder(lease));
    Session& session = sessions_.at(peer);
    warn("lease_expired", worker_name(session.hello) + ": no progress; its cells go to others",
         &session, lease);
    ++counters_.leases_expired;
    ++session.failures;
    end_task(session, lease, FarmEvents::End::kExpired, now);
    reply(peer, Cancel{{wire_id(lease)}});
  }
  look_after_sessions(now);
  turn_out_blocked();
  cancel_superseded();
  for (const CellKey& key : board_.take_given_up())
    warn("cell_given_up", work_.name_of(key) + ": " + work_.give_up(key), nullptr, {},
         work_.name_of(key));
  if (settings_.deadline && now >= *settings_.deadline && !cut_off_at_) cut_off(now);
  open_more();
  if (Status status = take_held(now); !status) return status;
  give_credit(now);
  if (Status status = commit_if_due(now); !status) return status;
  return feed_hungry(now);
}

std::vector<Outgoing> Desk::take_outgoing() { return std::exchange(outgoing_, {}); }

Millis Desk::next_wake(Millis now) const {
  Millis next = now + settings_.limits.heartbeat / 2;
  if (settings_.deadline && now < *settings_.deadline) next = std::min(next, *settings_.deadline);
  if (cut_off_at_) next = std::min(next, *cut_off_at_);
  if (work_.disk_full())
    next = std::min(next, commit_again_);
  else if (giving() && !hungry_.empty() && !board_.idle())
    next = std::min(next, next_spare_look_);
  if (!work_.disk_full() && work_.uncommitted() > 0)
    next = std::min(next, oldest_uncommitted_ + settings_.limits.commit_delay);
  return next;
}

void Desk::say_shutdown() {
  for (const auto& [peer, session] : sessions_) reply(peer, Shutdown{});
}

}  // namespace pvsfarm

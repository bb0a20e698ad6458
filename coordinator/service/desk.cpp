#include "coordinator/service/desk.hpp"

#include <algorithm>
#include <utility>

#include "common/base/check.hpp"

namespace pvsfarm {
namespace {

constexpr std::size_t kMaxWarnings = 100;  // waiting to be logged

}  // namespace

static_assert(BoardLimits{}.task_cells <= kMaxTaskCells);

Desk::Desk(DeskSettings settings, Work& work, Millis now)
    : settings_(std::move(settings)),
      work_(work),
      board_(settings_.limits.board, (settings_.epoch & 0xffffffff) << 32 | 1),
      start_(now),
      ticked_(now) {
  open_more();
}

void Desk::open_more() {
  if (cut_off_at_) return;
  for (const CellKey& key : work_.take_open(board_.pending_count())) board_.add(key);
}

bool Desk::done() const {
  return board_.idle() && work_.uncommitted() == 0 && (!cut_off_at_ || ticked_ >= *cut_off_at_);
}

void Desk::warn(std::string text) {
  last_error_ = text;
  if (warnings_.size() < kMaxWarnings) warnings_.push_back(std::move(text));
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

void Desk::drop(const std::string& peer, Board::Parting parting) {
  const auto found = sessions_.find(peer);
  if (found == sessions_.end()) return;
  Session& session = found->second;
  if (session.incoming) incoming_bytes_ -= session.incoming->bytes;
  board_.leave(session.worker, parting);
  peers_.erase(session.worker);
  hungry_.erase(peer);
  sessions_.erase(found);
}

void Desk::gone(const std::string& peer) {
  const auto found = sessions_.find(peer);
  if (found == sessions_.end()) return;
  if (board_.lease_count(found->second.worker) > 0)
    warn(worker_name(found->second.hello) + ": connection lost; its cells go to others");
  drop(peer, Board::Parting::kLost);
}

void Desk::worker_exited(std::uint32_t pid) {
  for (const auto& [peer, session] : sessions_)
    if (session.hello.pid == pid) return gone(std::string(peer));
}

Status Desk::receive(const std::string& peer, const Result<Decoded>& decoded, Millis now,
                     Role role) {
  if (!decoded) {
    reject(peer, RejectCode::kBadMessage, decoded.error().text);
    warn("peer dropped: " + decoded.error().text);
    drop(peer, Board::Parting::kLost);
    return {};
  }
  const Message& message = decoded->message;
  if (!permits(role, message)) {
    const std::string text = std::string("a key of role ") + std::string(role_name(role)) +
                             " may not send " + type_name(message);
    reject(peer, RejectCode::kForbidden, text);
    warn("peer refused: " + text);
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
    (control->kind == ControlKind::kDrain ? drain_asked_ : cancel_asked_) = true;
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
  code = RejectCode::kFull;
  if (sessions_.size() >= settings_.limits.sessions)
    return "the coordinator has its limit of " + std::to_string(sessions_.size()) + " workers";
  return "";
}

void Desk::on_hello(const std::string& peer, const Hello& hello, Millis now) {
  // A worker that says HELLO again has forgotten its tasks, or lost its connection.
  drop(peer, Board::Parting::kGraceful);
  for (const auto& [other, session] : sessions_)
    if (session.hello.worker == hello.worker) {
      drop(std::string(other), Board::Parting::kGraceful);
      break;
    }
  RejectCode code{};
  if (const std::string text = refusal(hello, code); !text.empty()) {
    reject(peer, code, text);
    warn(worker_name(hello) + " refused: " + text);
    return;
  }
  if (settings_.pinned_kernel.empty())
    settings_.pinned_kernel = describe(hello.kernel, settings_.evaluator);
  kernel_id_ = kernel_id(hello.kernel, settings_.evaluator, settings_.scene_digest);

  Session session{.worker = WorkerId{++last_worker_}, .token = last_worker_, .hello = hello};
  session.minor = std::min(hello.minor_highest, kProtocolMinorHighest);
  session.heard = session.sent = now;
  board_.join(session.worker, hello.slots);
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
    on_begin(session, begin->lease, begin->bytes, *begin);
  } else if (const auto* finding = std::get_if<FindingBegin>(&message)) {
    on_begin(session, finding->lease, finding->bytes, *finding);
  } else if (const auto* chunk = std::get_if<ResultChunk>(&message)) {
    on_chunk(session, *chunk);
  } else if (const auto* end = std::get_if<ResultEnd>(&message)) {
    return on_end(peer, session, *end, now);
  } else if (const auto* failed = std::get_if<TaskFailed>(&message)) {
    on_failed(session, *failed);
    return hand_out(peer, session, now);
  } else if (const auto* get = std::get_if<BlobGet>(&message)) {
    on_blob_get(peer, *get);
  } else if (std::holds_alternative<Draining>(message)) {
    board_.stop_leasing(session.worker);
  } else if (std::holds_alternative<Bye>(message)) {
    drop(peer, Board::Parting::kGraceful);
  } else {
    reject(peer, RejectCode::kBadMessage, "not a message for a coordinator");
    drop(peer, Board::Parting::kLost);
  }
  return {};
}

Status Desk::on_heartbeat(const std::string& peer, Session& session, const Heartbeat& beat,
                          Millis now) {
  session.resident_bytes = beat.resident_bytes;
  HeartbeatAck ack;
  std::set<BoardLease> still;
  for (const Heartbeat::Running& running : beat.running) {
    const BoardLease id = board_id(running.lease);
    const bool renewed =
        board_.holder(id) == session.worker && board_.renew(id, running.progress, now);
    still.insert(id);
    (renewed ? ack.renewed : ack.cancelled).push_back(running.lease);
  }
  reply(peer, std::move(ack));
  session.sent = now;
  board_.release_expired(session.worker, still);
  session.ready = beat.ready;
  return hand_out(peer, session, now);
}

void Desk::on_failed(const Session& session, const TaskFailed& failed) {
  const BoardLease id = board_id(failed.lease);
  if (board_.holder(id) != session.worker) return;
  warn(worker_name(session.hello) + ": " + failed.text);
  board_.fail(id, failed.kind == FailureKind::kDeterministic ? Board::Failure::kDeterministic
                                                             : Board::Failure::kTransient);
}

void Desk::on_blob_get(const std::string& peer, const BlobGet& get) {
  SharedSet keep;
  std::span<const std::byte> blob;
  if (get.digest == settings_.scene_digest) {
    blob = settings_.scene;
  } else if ((keep = shelf_.find(get.digest))) {
    blob = *keep;
  }
  BlobChunk chunk{.digest = get.digest, .offset = get.offset, .total_bytes = blob.size()};
  if (get.offset > blob.size()) chunk.offset = blob.size();
  const std::span<const std::byte> rest = blob.subspan(chunk.offset);
  const std::span<const std::byte> part = rest.first(std::min(rest.size(), kChunkBytes));
  chunk.data.assign(part.begin(), part.end());
  reply(peer, std::move(chunk));
}

Status Desk::hand_out(const std::string& peer, Session& session, Millis now) {
  if (!leasing_ || work_.disk_full() || !session.ready ||
      now - session.heard > settings_.limits.suspect)
    return {};
  const auto together = [&](const CellKey& first, const CellKey& next) {
    return work_.together(first, next);
  };
  while (const std::optional<BoardTask> task = board_.lease(session.worker, now, together)) {
    Result<Message> message = work_.task(*task, shelf_);
    if (!message) return message.error();
    reply(peer, std::move(message).value());
    session.sent = now;
  }
  if (board_.pending_count() == 0) hungry_.insert(peer);
  return {};
}

// While the disk is full, nothing is begun or acknowledged, and workers keep what they have: they
// are only told that we live.
Status Desk::commit(Millis now) {
  const bool was_full = work_.disk_full();
  if (was_full && now < commit_again_) return {};
  if (Status status = work_.commit(); !status) return status;
  commit_again_ = now + settings_.limits.disk_full_retry;
  if (was_full && !work_.disk_full())
    for (const auto& [peer, session] : sessions_) hungry_.insert(peer);
  if (work_.disk_full() != was_full)
    warn(was_full ? "the disk has room again: going on"
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
  }
  for (const std::string& peer : lost) gone(peer);
}

// The deadline has passed: nothing more is given away, what runs is called back, and what its
// workers have of it so far is awaited for a moment.
void Desk::cut_off(Millis now) {
  cut_off_at_ = now + settings_.limits.cut_off;
  leasing_ = false;
  for (const BoardLease lease : board_.clear())
    reply(peers_.at(*board_.holder(lease)), Cancel{{wire_id(lease)}});
}

Status Desk::tick(Millis now) {
  ticked_ = now;
  for (const BoardLease lease : board_.expire(now)) {
    const std::string& peer = peers_.at(*board_.holder(lease));
    warn(worker_name(sessions_.at(peer).hello) + ": no progress; its cells go to others");
    reply(peer, Cancel{{wire_id(lease)}});
  }
  look_after_sessions(now);
  for (const CellKey& key : board_.take_given_up())
    warn(work_.name_of(key) + ": " + work_.give_up(key));
  if (settings_.deadline && now >= *settings_.deadline && !cut_off_at_) cut_off(now);
  open_more();
  if (Status status = commit_if_due(now); !status) return status;
  while (leasing_ && !work_.disk_full() && board_.pending_count() > 0 && !hungry_.empty()) {
    const std::string peer = *hungry_.begin();
    hungry_.erase(hungry_.begin());
    if (Status status = hand_out(peer, sessions_.at(peer), now); !status) return status;
  }
  return {};
}

std::vector<Outgoing> Desk::take_outgoing() { return std::exchange(outgoing_, {}); }

Millis Desk::next_wake(Millis now) const {
  Millis next = now + settings_.limits.heartbeat / 2;
  if (settings_.deadline && now < *settings_.deadline) next = std::min(next, *settings_.deadline);
  if (cut_off_at_) next = std::min(next, *cut_off_at_);
  if (work_.disk_full())
    next = std::min(next, commit_again_);
  else if (work_.uncommitted() > 0)
    next = std::min(next, oldest_uncommitted_ + settings_.limits.commit_delay);
  return next;
}

void Desk::say_shutdown() {
  for (const auto& [peer, session] : sessions_) reply(peer, Shutdown{});
}

StatusReport Desk::status(Millis now) {
  const auto [figures, result_bytes] = work_.progress(now);
  StatusReport report{.output = settings_.output,
                      .state = leasing_ ? "running" : "draining",
                      .cells_done = figures.cells_done,
                      .cells_open = figures.cells_open,
                      .cells_expected = figures.cells_expected,
                      .cells_per_second = figures.cells_per_second,
                      .eta_s = figures.eta_s,
                      .result_bytes = result_bytes,
                      .elapsed_ms = static_cast<std::uint64_t>((now - start_).count()),
                      .last_error = last_error_};
  for (const auto& [worker, peer] : peers_) {
    const Session& session = sessions_.at(peer);
    report.workers.push_back({session.hello.host, session.hello.pid, session.cells_done,
                              static_cast<std::uint32_t>(board_.lease_count(worker)),
                              static_cast<std::uint64_t>((now - session.heard).count()),
                              session.resident_bytes});
  }
  return report;
}

}  // namespace pvsfarm

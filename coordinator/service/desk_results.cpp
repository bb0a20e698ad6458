// The way of a result: begin, credit, chunks, end, the work, and the answer once it is durable.
#include <algorithm>

#include "coordinator/service/desk.hpp"

namespace pvsfarm {

void Desk::forget_incoming(Session& session) {
  if (!session.incoming) return;
  if (session.incoming->on_credit)
    credit_.release(session.worker);
  else
    credit_.free(session.incoming->bytes);
  session.incoming.reset();
}

// A lease is one worker's. Late results count, whatever became of their leases, and so do those
// under leases of a coordinator before this one, which alone knew whose they were.
bool Desk::foreign(const std::string& peer, const Session& session, LeaseId lease, Millis now) {
  const BoardLease id = board_id(lease);
  const std::optional<WorkerId> holder = board_.holder(id);
  if (owners_.claim(id, session.worker) != LeaseOwners::Claim::kAnothers &&
      (!holder || *holder == session.worker))
    return false;
  const std::string text = "a result under a lease that is not this worker's";
  warn("foreign_result", worker_name(session.hello) + " dropped: " + text, &session, id);
  reject(peer, RejectCode::kForbidden, text);
  drop(peer, Board::Parting::kLost, now);
  return true;
}

void Desk::on_begin(Session& session, LeaseId lease, std::uint64_t bytes,
                    std::variant<ResultBegin, FindingBegin> head, Millis now) {
  forget_incoming(session);
  session.incoming = std::make_unique<Incoming>();
  Incoming& incoming = *session.incoming;
  incoming.result = {.lease = lease, .head = std::move(head)};
  incoming.bytes = bytes;
  incoming.touched = now;
  incoming.on_credit = session.minor >= kMinorWithCredit && bytes > kFreeResultBytes;
  if (incoming.on_credit) {
    credit_.ask(session.worker, bytes);
    give_credit(now);
    return;
  }
  incoming.granted = bytes / kChunkBytes + 1;
  incoming.broken = credit_.used() + bytes > 2 * settings_.limits.incoming_bytes;
  credit_.use(bytes);
}

void Desk::give_credit(Millis now) {
  if (work_.disk_full()) return;
  while (const std::optional<WorkerId> worker = credit_.next()) {
    const std::string& peer = peers_.at(*worker);
    Incoming& incoming = *sessions_.at(peer).incoming;
    incoming.granted = kCreditChunks;
    incoming.touched = now;
    incoming.result.data.reserve(incoming.bytes);
    reply(peer, ChunkCredit{incoming.result.lease, incoming.granted});
  }
}

void Desk::on_chunk(const std::string& peer, Session& session, const ResultChunk& chunk,
                    Millis now) {
  Incoming* incoming = session.incoming.get();
  if (incoming == nullptr || incoming->broken || incoming->result.lease != chunk.lease) return;
  Bytes& data = incoming->result.data;
  if (chunk.offset != data.size() || chunk.data.size() > incoming->bytes - data.size() ||
      data.size() + chunk.data.size() > incoming->granted * kChunkBytes) {
    incoming->broken = true;
    return;
  }
  data.insert(data.end(), chunk.data.begin(), chunk.data.end());
  incoming->touched = now;
  const std::uint64_t received = data.size() / kChunkBytes;
  if (!incoming->on_credit || incoming->granted - received > kCreditChunks / 2 ||
      incoming->granted * kChunkBytes >= incoming->bytes)
    return;
  incoming->granted = received + kCreditChunks;
  reply(peer, ChunkCredit{chunk.lease, incoming->granted});
}

Status Desk::on_end(const std::string& peer, Session& session, const ResultEnd& end, Millis now) {
  Incoming* incoming = session.incoming.get();
  if (incoming == nullptr || incoming->result.lease != end.lease || incoming->broken ||
      incoming->result.data.size() != incoming->bytes ||
      digest_of(incoming->result.data) != end.digest) {
    forget_incoming(session);
    reply(peer, ResultAck{end.lease, ResultOutcome::kResend});
    ++counters_.resends;
    return {};
  }
  WorkResult result = std::move(incoming->result);
  result.worker = worker_name(session.hello);
  result.id = session.worker;
  forget_incoming(session);
  if (owners_.claim(board_id(end.lease), session.worker) == LeaseOwners::Claim::kForgotten) {
    reply(peer, ResultAck{end.lease, ResultOutcome::kStale});
    return {};
  }
  if (!work_.disk_full() && held_.empty()) return take(peer, session.worker, result, now);
  const auto known = [&](const Held& held) {
    return held.result.lease == end.lease && held.worker == session.worker;
  };
  if (std::any_of(held_.begin(), held_.end(), known)) return {};
  if (held_.size() >= settings_.limits.held_results) {
    reply(peer, ResultAck{end.lease, ResultOutcome::kResend});
    return {};
  }
  credit_.use(result.data.size());
  held_.push_back({peer, session.worker, std::move(result)});
  return {};
}

Status Desk::take_held(Millis now) {
  while (!held_.empty() && !work_.disk_full()) {
    const Held held = std::move(held_.front());
    held_.pop_front();
    credit_.free(held.result.data.size());
    if (Status status = take(held.peer, held.worker, held.result, now); !status) return status;
  }
  return {};
}

Status Desk::take(const std::string& peer, WorkerId worker, const WorkResult& result, Millis now) {
  WorkAnswer answer;
  const bool first_of_batch = work_.uncommitted() == 0;
  const Status status = work_.accept(result, answer);
  if (first_of_batch && work_.uncommitted() > 0) oldest_uncommitted_ = now;
  const BoardLease lease = board_id(result.lease);
  const bool held = board_.holder(lease) == worker;
  double cost_ms = 0;
  for (const WorkAnswer::Done& done : answer.done) cost_ms += done.cost_ms;
  const double stretch = held ? board_.stretch(lease, cost_ms, now) : 1;
  for (const WorkAnswer::Done& done : answer.done) board_.complete(done.key, done.cost_ms, stretch);
  for (const WorkAnswer::Again& again : answer.again)
    for (const WorkerId avoid : again.avoid) board_.add_again(again.key, avoid);
  for (const CellKey& key : answer.checked) board_.withdraw(key);
  wrong_.insert(wrong_.end(), answer.wrong.begin(), answer.wrong.end());
  count_done(answer);
  open_more();
  const auto session = sessions_.find(peer);
  const bool there = session != sessions_.end() && session->second.worker == worker;
  if (there) session->second.cells_done += answer.done.size();
  Session* from = there ? &session->second : nullptr;
  for (std::string& warning : answer.warnings) warn("result", std::move(warning), from, lease);
  if (!status) {
    if (status.error().kind != ErrorKind::kInvalidInput) return status;
    warn("bad_result", result.worker + " dropped for a bad result: " + status.error().text, from,
         lease);
    reject(peer, RejectCode::kBadResult, status.error().text);
    if (there) drop(peer, Board::Parting::kLost, now);
    return {};
  }
  if (!answer.done.empty()) board_.did_well(worker);
  if (there) end_task(*from, lease, FarmEvents::End::kDone, now, answer.done);
  if (held) board_.finish(lease, now);
  cancel_superseded();
  acks_.push_back({peer, {result.lease, answer.outcome}});
  return there ? hand_out(peer, session->second, now) : Status{};
}

}  // namespace pvsfarm

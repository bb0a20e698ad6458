// The way of a result: begin, chunks, end, the work, and the answer once it is durable.
#include "coordinator/service/desk.hpp"

namespace pvsfarm {

void Desk::on_begin(Session& session, LeaseId lease, std::uint64_t bytes,
                    std::variant<ResultBegin, FindingBegin> head) {
  if (session.incoming) incoming_bytes_ -= session.incoming->bytes;
  session.incoming = std::make_unique<Incoming>();
  session.incoming->result = {.lease = lease, .head = std::move(head)};
  session.incoming->bytes = bytes;
  incoming_bytes_ += bytes;
  session.incoming->broken = incoming_bytes_ > settings_.limits.incoming_bytes;
}

void Desk::on_chunk(Session& session, const ResultChunk& chunk) {
  Incoming* incoming = session.incoming.get();
  if (incoming == nullptr || incoming->broken || incoming->result.lease != chunk.lease) return;
  Bytes& data = incoming->result.data;
  if (chunk.offset != data.size() || chunk.data.size() > incoming->bytes - data.size()) {
    incoming->broken = true;
    return;
  }
  data.insert(data.end(), chunk.data.begin(), chunk.data.end());
}

Status Desk::on_end(const std::string& peer, Session& session, const ResultEnd& end, Millis now) {
  const std::unique_ptr<Incoming> incoming = std::move(session.incoming);
  if (incoming) incoming_bytes_ -= incoming->bytes;
  if (!incoming || incoming->result.lease != end.lease || incoming->broken ||
      incoming->result.data.size() != incoming->bytes ||
      digest_of(incoming->result.data) != end.digest) {
    reply(peer, ResultAck{end.lease, ResultOutcome::kResend});
    return {};
  }
  incoming->result.worker = worker_name(session.hello);
  return take(peer, session, incoming->result, now);
}

Status Desk::take(const std::string& peer, Session& session, const WorkResult& result, Millis now) {
  WorkAnswer answer;
  const bool first_of_batch = work_.uncommitted() == 0;
  const Status status = work_.accept(result, answer);
  if (first_of_batch && work_.uncommitted() > 0) oldest_uncommitted_ = now;
  for (const WorkAnswer::Done& done : answer.done) board_.complete(done.key, done.cost_ms);
  session.cells_done += answer.done.size();
  for (std::string& warning : answer.warnings) warn(std::move(warning));
  open_more();
  if (!status) {
    if (status.error().kind != ErrorKind::kInvalidInput) return status;
    warn(result.worker + " dropped for a bad result: " + status.error().text);
    reject(peer, RejectCode::kBadResult, status.error().text);
    drop(peer, Board::Parting::kLost);
    return {};
  }
  const BoardLease lease = board_id(result.lease);
  if (board_.holder(lease) == session.worker) board_.finish(lease);
  acks_.push_back({peer, {result.lease, answer.outcome}});
  return hand_out(peer, session, now);
}

}  // namespace pvsfarm

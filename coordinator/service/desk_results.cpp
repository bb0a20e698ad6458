// The way of a result: begin, chunks, end, merge, and the answer once it is durable.
#include "coordinator/service/desk.hpp"

namespace pvsfarm {

void Desk::on_begin(Session& session, const ResultBegin& begin) {
  if (session.incoming) incoming_bytes_ -= session.incoming->head.bytes;
  session.incoming = std::make_unique<Incoming>();
  session.incoming->head = begin;
  incoming_bytes_ += begin.bytes;
  session.incoming->broken = incoming_bytes_ > settings_.limits.incoming_bytes;
}

void Desk::on_chunk(Session& session, const ResultChunk& chunk) {
  Incoming* incoming = session.incoming.get();
  if (incoming == nullptr || incoming->broken || incoming->head.lease != chunk.lease) return;
  if (chunk.offset != incoming->data.size() ||
      chunk.data.size() > incoming->head.bytes - incoming->data.size()) {
    incoming->broken = true;
    return;
  }
  incoming->data.insert(incoming->data.end(), chunk.data.begin(), chunk.data.end());
}

Status Desk::on_end(const std::string& peer, Session& session, const ResultEnd& end, Millis now) {
  const std::unique_ptr<Incoming> incoming = std::move(session.incoming);
  if (incoming) incoming_bytes_ -= incoming->head.bytes;
  if (!incoming || incoming->head.lease != end.lease || incoming->broken ||
      incoming->data.size() != incoming->head.bytes || digest_of(incoming->data) != end.digest) {
    reply(peer, ResultAck{end.lease, ResultOutcome::kResend});
    return {};
  }
  return merge_all(peer, session, *incoming, now);
}

void Desk::note_merged(const ResultRow& row, const MergeAnswer& answer) {
  const int depth = row.key.depth();
  board_.complete(row.key, row.statistics.cpu_ms);
  estimate_.done({depth, row.statistics.cpu_ms, answer.split, true});
  result_bytes_ += row.hidden.size() + row.seen.size();
  if (!answer.split) return;
  for (const int half : {0, 1}) {
    board_.add(row.key.child(half));
    estimate_.opened(depth + 1);
  }
}

// The evaluator kept those objects visible, so the result stands; but a certificate was wrong.
void Desk::note_contradictions(const Session& session, const ResultRow& row) {
  if (row.statistics.contradictions == 0) return;
  contradictions_ += row.statistics.contradictions;
  warn("A WITNESS REFUTES A CERTIFICATE: cell " + std::to_string(row.key.root) + "/" +
       std::to_string(row.key.path) + ", " + std::to_string(row.statistics.contradictions) +
       " objects, by worker " + session.hello.host + ":" + std::to_string(session.hello.pid) +
       "; they stay visible, but this is a bug of pvsfarm: please report it");
}

Status Desk::merge_all(const std::string& peer, Session& session, const Incoming& result,
                       Millis now) {
  ResultOutcome outcome = ResultOutcome::kDuplicate;
  std::size_t offset = 0;
  for (const DeltaHead& head : result.head.deltas) {
    ResultRow row{
        .key = head.key, .point_triangles = head.point_triangles, .statistics = head.statistics};
    const std::span<const std::byte> rest = std::span(result.data).subspan(offset);
    const auto hidden = rest.first(head.hidden_bytes);
    const auto seen = rest.subspan(head.hidden_bytes, head.seen_bytes);
    row.hidden.assign(hidden.begin(), hidden.end());
    row.seen.assign(seen.begin(), seen.end());
    offset += head.hidden_bytes + head.seen_bytes;
    const bool first_of_batch = log_.uncommitted() == 0;
    const Result<MergeAnswer> answer = merger_.apply(row);
    if (!answer) {
      if (answer.error().kind != ErrorKind::kInvalidInput) return answer.error();
      warn("worker " + session.hello.host + ":" + std::to_string(session.hello.pid) +
           " dropped for a bad result: " + answer.error().text);
      reject(peer, RejectCode::kBadResult, answer.error().text);
      drop(peer, Board::Parting::kLost);
      return {};
    }
    switch (answer->outcome) {
      case MergeOutcome::kMerged:
        note_contradictions(session, row);
        if (first_of_batch) oldest_uncommitted_ = now;
        note_merged(row, *answer);
        ++session.cells_done;
        if (outcome == ResultOutcome::kDuplicate) outcome = ResultOutcome::kMerged;
        break;
      case MergeOutcome::kDuplicate:
        break;
      case MergeOutcome::kStale:
        if (outcome != ResultOutcome::kMismatch) outcome = ResultOutcome::kStale;
        break;
      case MergeOutcome::kMismatch:
        ++disagreements_;
        outcome = ResultOutcome::kMismatch;
        warn("two workers disagree on cell " + std::to_string(row.key.root) + "/" +
             std::to_string(row.key.path) + "; the first result stays");
        break;
    }
  }
  const BoardLease lease{static_cast<std::uint64_t>(result.head.lease)};
  if (board_.holder(lease) == session.worker) board_.finish(lease);
  acks_.push_back({peer, {result.head.lease, outcome}});
  hand_out(peer, session, now);
  return {};
}

}  // namespace pvsfarm

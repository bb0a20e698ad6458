#include "worker/service/messenger.hpp"

#include <algorithm>
#include <utility>

namespace pvsfarm {
namespace {
constexpr Millis kGreetEvery{5'000};   // HELLO again while there is no answer
constexpr Millis kAskAgain{10'000};    // for a blob, while there is no answer
constexpr Millis kOfferAgain{20'000};  // a result, while it is not acknowledged
constexpr Millis kResendAfter{1'000};  // when asked for it again
constexpr Millis kFullRetry{10'000};
constexpr Millis kHangsFor{60'000};  // after its cancellation; then the process ends
}  // namespace

void Messenger::send(Message message) { outbox_.push_back(std::move(message)); }

void Messenger::greet() {
  session_ = 0;
  ready_ = false;
  jobs_.clear();  // the coordinator gives them again
  fetch_.reset();
  parent_bytes_.clear();
  outbox_.clear();
  uploads_.clear();
  running_known_ = false;
  for (auto& [lease, kept] : results_) kept.known = kept.offered = false;
  send(hello_);
  greet_at_ = now_ + kGreetEvery;
}

void Messenger::leave(int exit_code, std::string text) {
  if (!leaving_) leaving_ = Leaving{exit_code, std::move(text)};
}

std::optional<Messenger::Outgoing> Messenger::next_outgoing() {
  if (outbox_.empty()) return std::nullopt;
  Outgoing out{{.minor = minor_, .session = session_, .epoch = epoch_}, std::move(outbox_.front())};
  outbox_.pop_front();
  return out;
}

void Messenger::receive(const Result<Decoded>& decoded, Millis now) {
  now_ = now;
  if (!decoded) return leave(kExitRetry, "the coordinator sent: " + decoded.error().text);
  const Envelope& envelope = decoded->envelope;
  if (const auto* welcome = std::get_if<Welcome>(&decoded->message))
    return on_welcome(envelope, *welcome);
  if (const auto* reject = std::get_if<Reject>(&decoded->message)) return on_reject(*reject);
  if (session_ == 0 || envelope.session != session_ || envelope.epoch != epoch_) return;

  if (const auto* task = std::get_if<Task>(&decoded->message)) {
    on_job({*task});
  } else if (const auto* inquiry = std::get_if<Inquiry>(&decoded->message)) {
    on_job({*inquiry});
  } else if (const auto* ack = std::get_if<ResultAck>(&decoded->message)) {
    on_ack(*ack);
  } else if (const auto* credit = std::get_if<ChunkCredit>(&decoded->message)) {
    on_credit(*credit);
  } else if (const auto* chunk = std::get_if<BlobChunk>(&decoded->message)) {
    on_blob(*chunk);
  } else if (const auto* beat = std::get_if<HeartbeatAck>(&decoded->message)) {
    for (const LeaseId lease : beat->cancelled) forget(lease);
    for (const LeaseId lease : beat->renewed)
      if (running_ && running_->lease == lease) {
        running_known_ = true;
      } else if (const auto kept = results_.find(lease); kept != results_.end()) {
        kept->second.known = true;
      }
  } else if (const auto* cancel = std::get_if<Cancel>(&decoded->message)) {
    for (const LeaseId lease : cancel->leases) forget(lease);
  } else if (std::holds_alternative<Drain>(decoded->message)) {
    drain();
  } else if (std::holds_alternative<Shutdown>(decoded->message)) {
    send(Bye{});
    leave(kExitDone, "");
  }
}

void Messenger::on_welcome(const Envelope& envelope, const Welcome& welcome) {
  if (session_ != 0) return;  // an answer to a HELLO that was repeated
  const Digest ours = kernel_id(hello_.kernel, welcome.settings, welcome.scene);
  if (ours != welcome.kernel_id)
    return leave(kExitDoNotRetry, "kernel: this worker computes " + ours.hex() +
                                      ", the coordinator needs " + welcome.kernel_id.hex());
  session_ = envelope.session;
  epoch_ = envelope.epoch;
  minor_ = welcome.minor;
  heartbeat_ = Millis(welcome.heartbeat_ms);
  const bool same_scene =
      welcome_ && welcome_->scene == welcome.scene && welcome_->settings == welcome.settings;
  if (welcome_ && !same_scene) results_.clear();  // of another bake
  welcome_ = welcome;
  scene_request_ = welcome;
  scene_chunk_.reset();
  // What it has is told before another gets it.
  beat_at_ = running_ || !results_.empty() ? now_ : now_ + heartbeat_;
  fetch_.reset();
  for (auto& [lease, kept] : results_) offer(lease, kept);
}

void Messenger::on_reject(const Reject& reject) {
  switch (reject.code) {
    case RejectCode::kUnknownSession:
      if (session_ != 0) greet();
      return;
    case RejectCode::kFull:
      greet_at_ = now_ + kFullRetry;
      return;
    case RejectCode::kProtocol:
    case RejectCode::kKernel:
    case RejectCode::kForbidden:
    case RejectCode::kBadResult:
    case RejectCode::kBlocked:
      return leave(kExitDoNotRetry, "rejected: " + reject.text);
    case RejectCode::kBadMessage:
      return leave(kExitRetry, "rejected: " + reject.text);
  }
}

void Messenger::on_job(Job job) {
  if (draining_) return;
  jobs_.push_back(std::move(job));
  if (jobs_.size() == 1) request_parent();
}

void Messenger::fetch(const Digest& digest, std::uint64_t total, std::uint64_t have) {
  fetch_ = Fetch{digest, total, have, have};
  ask_more();
}

// As many chunks as may be on their way at a time.
void Messenger::ask_more() {
  ask_again_ = now_ + kAskAgain;
  while (fetch_->asked < fetch_->total &&
         fetch_->asked - fetch_->received < kCreditChunks * kChunkBytes) {
    send(BlobGet{fetch_->digest, fetch_->asked});
    fetch_->asked += kChunkBytes;
  }
}

// Asks for the next set of the first job that came as a digest.
void Messenger::request_parent() {
  if (jobs_.empty() || fetch_) return;
  for (const ParentSet& parent : jobs_.front().sets())
    if (parent.set_bytes != 0) return fetch(parent.digest, parent.set_bytes, 0);
}

std::optional<Job> Messenger::take_job() {
  if (jobs_.empty() || !ready_ || draining_) return std::nullopt;
  for (const ParentSet& parent : jobs_.front().sets())
    if (parent.set_bytes != 0) return std::nullopt;
  Job job = std::move(jobs_.front());
  jobs_.pop_front();
  running_ = Running{job.lease(), 0};
  running_known_ = true;
  running_cells_.clear();
  if (const auto* task = std::get_if<Task>(&job.work))
    for (const TaskCell& cell : task->cells) running_cells_.push_back(cell.key);
  request_parent();
  return job;
}

std::optional<Welcome> Messenger::take_scene_request() {
  return std::exchange(scene_request_, std::nullopt);
}

void Messenger::fetch_scene(std::uint64_t have_bytes) {
  fetch(welcome_->scene, welcome_->scene_bytes, have_bytes);
}

std::optional<BlobChunk> Messenger::take_scene_chunk() {
  return std::exchange(scene_chunk_, std::nullopt);
}

void Messenger::on_blob(BlobChunk chunk) {
  // What is not next was overtaken on its way, and is asked for again.
  if (!fetch_ || fetch_->digest != chunk.digest || fetch_->received != chunk.offset) return;
  if (chunk.total_bytes == 0)
    return leave(kExitRetry, "the coordinator has lost a blob that it offered");
  if (chunk.total_bytes != fetch_->total)
    return leave(kExitRetry, "a blob has another size than was told");
  if (chunk.data.empty()) return leave(kExitRetry, "the coordinator sent an empty part of a blob");
  fetch_->received += chunk.data.size();
  fetch_->asked = std::max(fetch_->asked, fetch_->received);
  const bool complete = fetch_->received >= fetch_->total;
  if (!complete) ask_more();
  if (chunk.digest == welcome_->scene) {
    if (complete) fetch_.reset();
    scene_chunk_ = std::move(chunk);
    return;
  }
  parent_bytes_.insert(parent_bytes_.end(), chunk.data.begin(), chunk.data.end());
  if (!complete) return;
  fetch_.reset();
  if (digest_of(parent_bytes_) != chunk.digest)
    return leave(kExitRetry, "a parent set arrived damaged");
  for (ParentSet& parent : jobs_.front().sets())
    if (parent.set_bytes != 0 && parent.digest == chunk.digest) {
      parent = ParentSet{.set = std::exchange(parent_bytes_, {})};
      break;
    }
  parent_bytes_.clear();
  request_parent();
}

void Messenger::finished(JobResult result) {
  const LeaseId lease = result.lease;
  running_.reset();
  running_cells_.clear();
  if (cancelled_ == lease) cancelled_.reset();
  if (result.failure) {
    send(*result.failure);
    return;
  }
  const Digest digest = digest_of(result.data);
  const auto [at, fresh] = results_.insert_or_assign(lease, Kept{std::move(result), digest});
  at->second.known = running_known_;
  if (session_ != 0) offer(lease, at->second);
}

void Messenger::offer(LeaseId lease, Kept& kept) {
  kept.offer_again = now_ + kOfferAgain;
  if (kept.offered) {
    // It waits for those before it; if it is the first, something of it was lost on the way.
    if (uploads_.front() == lease) begin_upload();
    return;
  }
  kept.offered = true;
  uploads_.push_back(lease);
  if (uploads_.size() == 1) begin_upload();
}

void Messenger::begin_upload() {
  if (uploads_.empty()) return;
  Kept& kept = results_.at(uploads_.front());
  const JobResult& result = kept.result;
  kept.offer_again = now_ + kOfferAgain;
  kept.sent = 0;
  const bool waits = minor_ >= kMinorWithCredit && result.data.size() > kFreeResultBytes;
  kept.credit = waits ? 0 : result.data.size() / kChunkBytes + 1;
  if (result.findings.empty())
    send(ResultBegin{result.lease, result.data.size(), result.deltas});
  else
    send(FindingBegin{result.lease, result.data.size(), result.findings});
  go_on_with_upload();
}

void Messenger::on_credit(const ChunkCredit& credit) {
  if (uploads_.empty() || uploads_.front() != credit.lease) return;
  Kept& kept = results_.at(credit.lease);
  kept.credit = std::max(kept.credit, credit.chunks);
  kept.offer_again = now_ + kOfferAgain;
  go_on_with_upload();
}

void Messenger::go_on_with_upload() {
  Kept& kept = results_.at(uploads_.front());
  const JobResult& result = kept.result;
  std::uint64_t offset = kept.sent * kChunkBytes;
  for (; offset < result.data.size() && kept.sent < kept.credit; ++kept.sent) {
    const std::uint64_t end = std::min<std::uint64_t>(offset + kChunkBytes, result.data.size());
    const auto first = result.data.begin();
    send(ResultChunk{result.lease, offset,
                     Bytes(first + static_cast<std::ptrdiff_t>(offset),
                           first + static_cast<std::ptrdiff_t>(end))});
    offset = end;
  }
  if (offset < result.data.size() || kept.credit == 0) return;
  send(ResultEnd{result.lease, kept.digest});
  kept.offered = false;
  uploads_.pop_front();
  begin_upload();
}

void Messenger::on_ack(const ResultAck& ack) {
  const auto kept = results_.find(ack.lease);
  if (kept == results_.end()) return;
  if (ack.outcome == ResultOutcome::kResend) {
    kept->second.offer_again = now_ + kResendAfter;
    return;
  }
  const bool first = !uploads_.empty() && uploads_.front() == ack.lease;
  std::erase(uploads_, ack.lease);
  results_.erase(kept);
  if (first) begin_upload();
}

// The coordinator no longer waits for a lease. What is computed already is offered all the same:
// it may still be the first.
void Messenger::forget(LeaseId lease) {
  if (running_ && running_->lease == lease && cancelled_ != lease) {
    cancelled_ = lease;
    cancelled_progress_ = running_->progress;
    cancelled_at_ = now_;
  }
  const bool first = !jobs_.empty() && jobs_.front().lease() == lease;
  std::erase_if(jobs_, [&](const Job& job) { return job.lease() == lease; });
  if (!first) return;
  if (fetch_ && welcome_ && fetch_->digest == welcome_->scene) return;
  parent_bytes_.clear();
  fetch_.reset();
  request_parent();
}

// A computation that neither ends nor advances after its cancellation never will: only the end of
// the process ends it.
void Messenger::look_for_hang() {
  if (!running_ || cancelled_ != running_->lease) return;
  if (running_->progress != cancelled_progress_) {
    cancelled_progress_ = running_->progress;
    cancelled_at_ = now_;
  }
  if (now_ - cancelled_at_ > kHangsFor)
    leave(kExitRetry, "the computation hangs; its cells went to others");
}

void Messenger::drain() {
  draining_ = true;
  jobs_.clear();  // BYE gives them back
}

void Messenger::tick(Millis now) {
  now_ = now;
  if (leaving_) return;
  look_for_hang();
  if (session_ == 0) {
    if (draining_) return leave(kExitDone, "");
    if (now >= greet_at_) greet();
    return;
  }
  if (draining_ && !std::exchange(draining_said_, true)) send(Draining{});
  if (draining_ && !running_ && results_.empty()) {
    send(Bye{});
    return leave(kExitDone, "");
  }
  for (auto& [lease, kept] : results_)
    if (now >= kept.offer_again) offer(lease, kept);
  if (fetch_ && now >= ask_again_) {
    fetch_->asked = fetch_->received;
    ask_more();
  }
  if (now < beat_at_) return;
  beat_at_ = now + heartbeat_;
  Heartbeat beat{.resident_bytes = resident_bytes_, .ready = ready_ && !draining_};
  if (running_) {
    beat.running.push_back({running_->lease, running_->progress, {}});
    if (!running_known_) beat.running.back().cells = running_cells_;
  }
  for (const auto& [lease, kept] : results_) {
    beat.running.push_back({lease, kProgressComputed, {}});
    if (kept.known) continue;
    for (const DeltaHead& head : kept.result.deltas) beat.running.back().cells.push_back(head.key);
  }
  for (const Job& job : jobs_) beat.running.push_back({job.lease(), 0, {}});
  send(std::move(beat));
}

Millis Messenger::next_wake() const { return session_ == 0 ? greet_at_ : beat_at_; }

}  // namespace pvsfarm

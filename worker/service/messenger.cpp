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
}  // namespace

void Messenger::send(Message message) { outbox_.push_back(std::move(message)); }

void Messenger::greet() {
  session_ = 0;
  ready_ = false;
  jobs_.clear();  // the coordinator gives them again
  asked_.reset();
  parent_bytes_.clear();
  outbox_.clear();
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
  } else if (const auto* chunk = std::get_if<BlobChunk>(&decoded->message)) {
    on_blob(*chunk);
  } else if (const auto* beat = std::get_if<HeartbeatAck>(&decoded->message)) {
    for (const LeaseId lease : beat->cancelled) forget(lease);
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
  scene_bytes_have_.reset();
  scene_chunk_.reset();
  beat_at_ = now_ + heartbeat_;
  asked_.reset();
  for (auto& [lease, kept] : results_) offer(kept);
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

void Messenger::ask_blob(const Digest& digest, std::uint64_t offset) {
  asked_ = BlobGet{digest, offset};
  ask_again_ = now_ + kAskAgain;
  send(*asked_);
}

// Asks for the next set of the first job that came as a digest.
void Messenger::request_parent() {
  if (jobs_.empty() || asked_) return;
  for (const ParentSet& parent : jobs_.front().sets())
    if (parent.set_bytes != 0) return ask_blob(parent.digest, parent_bytes_.size());
}

std::optional<Job> Messenger::take_job() {
  if (jobs_.empty() || !ready_ || draining_) return std::nullopt;
  for (const ParentSet& parent : jobs_.front().sets())
    if (parent.set_bytes != 0) return std::nullopt;
  Job job = std::move(jobs_.front());
  jobs_.pop_front();
  running_ = Running{job.lease(), 0};
  request_parent();
  return job;
}

std::optional<Welcome> Messenger::take_scene_request() {
  return std::exchange(scene_request_, std::nullopt);
}

void Messenger::fetch_scene(std::uint64_t have_bytes) {
  scene_bytes_have_ = have_bytes;
  ask_blob(welcome_->scene, have_bytes);
}

std::optional<BlobChunk> Messenger::take_scene_chunk() {
  return std::exchange(scene_chunk_, std::nullopt);
}

void Messenger::on_blob(BlobChunk chunk) {
  if (!asked_ || asked_->digest != chunk.digest || asked_->offset != chunk.offset) return;
  asked_.reset();
  if (chunk.total_bytes == 0)
    return leave(kExitRetry, "the coordinator has lost a blob that it offered");
  if (scene_bytes_have_ && chunk.digest == welcome_->scene) {
    *scene_bytes_have_ += chunk.data.size();
    if (*scene_bytes_have_ < chunk.total_bytes)
      ask_blob(chunk.digest, *scene_bytes_have_);
    else
      scene_bytes_have_.reset();
    scene_chunk_ = std::move(chunk);
    return;
  }
  if (jobs_.empty()) return;
  for (ParentSet& parent : jobs_.front().sets()) {
    if (parent.set_bytes == 0) continue;
    if (parent.digest != chunk.digest) return request_parent();
    if (chunk.total_bytes != parent.set_bytes)
      return leave(kExitRetry, "a parent set has another size than its task says");
    parent_bytes_.insert(parent_bytes_.end(), chunk.data.begin(), chunk.data.end());
    if (parent_bytes_.size() == parent.set_bytes) {
      if (digest_of(parent_bytes_) != parent.digest)
        return leave(kExitRetry, "a parent set arrived damaged");
      parent = ParentSet{.set = std::exchange(parent_bytes_, {})};
    }
    return request_parent();
  }
}

void Messenger::finished(JobResult result) {
  const LeaseId lease = result.lease;
  running_.reset();
  if (cancelled_ == lease) cancelled_.reset();
  if (result.failure) {
    send(*result.failure);
    return;
  }
  const auto [at, fresh] = results_.insert_or_assign(lease, Kept{std::move(result)});
  if (session_ != 0) offer(at->second);
}

void Messenger::offer(Kept& kept) {
  const JobResult& result = kept.result;
  kept.offer_again = now_ + kOfferAgain;
  if (result.findings.empty())
    send(ResultBegin{result.lease, result.data.size(), result.deltas});
  else
    send(FindingBegin{result.lease, result.data.size(), result.findings});
  for (std::size_t offset = 0; offset < result.data.size(); offset += kChunkBytes) {
    const std::size_t end = std::min(offset + kChunkBytes, result.data.size());
    const auto first = result.data.begin();
    send(ResultChunk{result.lease, offset,
                     Bytes(first + static_cast<std::ptrdiff_t>(offset),
                           first + static_cast<std::ptrdiff_t>(end))});
  }
  send(ResultEnd{result.lease, digest_of(result.data)});
}

void Messenger::on_ack(const ResultAck& ack) {
  const auto kept = results_.find(ack.lease);
  if (kept == results_.end()) return;
  if (ack.outcome == ResultOutcome::kResend)
    kept->second.offer_again = now_ + kResendAfter;
  else
    results_.erase(kept);
}

// The coordinator no longer waits for a lease. What is computed already is offered all the same:
// it may still be the first.
void Messenger::forget(LeaseId lease) {
  if (running_ && running_->lease == lease) cancelled_ = lease;
  const bool first = !jobs_.empty() && jobs_.front().lease() == lease;
  std::erase_if(jobs_, [&](const Job& job) { return job.lease() == lease; });
  if (!first) return;
  parent_bytes_.clear();
  asked_.reset();
  request_parent();
}

void Messenger::drain() {
  draining_ = true;
  jobs_.clear();  // BYE gives them back
}

void Messenger::tick(Millis now) {
  now_ = now;
  if (leaving_) return;
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
    if (now >= kept.offer_again) offer(kept);
  if (asked_ && now >= ask_again_) ask_blob(asked_->digest, asked_->offset);
  if (now < beat_at_) return;
  beat_at_ = now + heartbeat_;
  Heartbeat beat{.resident_bytes = resident_bytes_, .ready = ready_ && !draining_};
  if (running_) beat.running.push_back({running_->lease, running_->progress});
  for (const Job& job : jobs_) beat.running.push_back({job.lease(), 0});
  send(std::move(beat));
}

Millis Messenger::next_wake() const { return session_ == 0 ? greet_at_ : beat_at_; }

}  // namespace pvsfarm

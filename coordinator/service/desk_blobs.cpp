// Blobs for workers: the scene, and sets of objects that are too large for a task. A worker asks
// for each chunk, for kCreditChunks of them at a time; all workers together have a limit, and those
// beyond it wait for their turn.
#include <algorithm>

#include "coordinator/service/desk.hpp"

namespace pvsfarm {
namespace {
constexpr Millis kForgotten{10'000};       // chunks that nobody asked beyond for so long
constexpr std::size_t kMaxAsked = 16'384;  // waiting; a worker asks again
}  // namespace

void Desk::on_blob_get(const std::string& peer, Session& session, const BlobGet& get, Millis now) {
  // Who asks for one more has all but the last ones before.
  blobs_arrived(session, kCreditChunks - 1);
  session.blob_asked = now;
  if (blobs_asked_.size() < kMaxAsked) blobs_asked_.push_back({peer, get});
  send_blobs();
}

void Desk::blobs_arrived(Session& session, std::size_t still_on_their_way) {
  const std::size_t left = std::min<std::size_t>(session.blob_chunks, still_on_their_way);
  blob_chunks_ -= session.blob_chunks - left;
  session.blob_chunks = left;
}

void Desk::send_blobs() {
  while (!blobs_asked_.empty() && blob_chunks_ < settings_.limits.blob_chunks) {
    const BlobAsked asked = std::move(blobs_asked_.front());
    blobs_asked_.pop_front();
    const auto session = sessions_.find(asked.peer);
    if (session == sessions_.end()) continue;
    ++session->second.blob_chunks;
    ++blob_chunks_;
    send_blob(asked.peer, asked.get);
  }
}

void Desk::send_blob(const std::string& peer, const BlobGet& get) {
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

void Desk::forget_blobs(Millis now) {
  for (auto& [peer, session] : sessions_)
    if (session.blob_chunks > 0 && now - session.blob_asked > kForgotten) blobs_arrived(session, 0);
  send_blobs();
}

}  // namespace pvsfarm

// The worker's side of the exchange, without sockets, clocks and threads: takes messages, results
// and the time; gives messages, and tasks to compute. It never computes itself, so it answers
// while a computation hangs.
//
//   HELLO -> WELCOME -> (BLOB_GET ... the scene) -> HEARTBEAT ready -> TASK -> RESULT -> RESULT_ACK
//
// A result is kept until it is acknowledged, and offered again to a coordinator that was restarted,
// which also hears what is being computed. Results go one after the other; a large one waits for
// credit (docs/protocol.md, "Credit").
// Threads: one.
#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/wire/codec.hpp"

namespace pvsfarm {

using Millis = std::chrono::milliseconds;

// How a worker's process ends; a batch system decides by it whether to start another.
inline constexpr int kExitDone = 0;
inline constexpr int kExitDoNotRetry = 42;
inline constexpr int kExitRetry = 75;

// What a coordinator gives to compute. Once taken, no set has a digest any more: all are at hand.
struct Job {
  std::variant<Task, Inquiry> work;

  LeaseId lease() const {
    return std::visit([](const auto& given) { return given.lease; }, work);
  }
  std::vector<ParentSet>& sets() {
    auto* task = std::get_if<Task>(&work);
    return task != nullptr ? task->parents : std::get<Inquiry>(work).sets;
  }
};

// Either deltas, or findings, or a failure.
struct JobResult {
  LeaseId lease{};
  std::vector<DeltaHead> deltas;
  std::vector<FindingHead> findings;
  Bytes data;  // of all deltas the hidden set, then the seen one, end to end; or all findings
  std::optional<TaskFailed> failure;
};

struct Running {
  LeaseId lease{};
  std::uint64_t progress = 0;
};

struct Leaving {
  int exit_code = kExitDone;
  std::string text;  // why, for the log; "" if it needs no words
};

class Messenger {
 public:
  Messenger(Hello hello, Millis now) : hello_(std::move(hello)), now_(now) {}

  void receive(const Result<Decoded>& decoded, Millis now);
  void tick(Millis now);
  Millis next_wake() const;

  // The next message for the coordinator; sent in this order.
  struct Outgoing {
    Envelope envelope;
    Message message;
  };
  std::optional<Outgoing> next_outgoing();

  // The scene to get ready, once after each WELCOME that names another than the last.
  std::optional<Welcome> take_scene_request();
  // Either the scene was found here, or it is to be fetched: then every chunk comes through
  // take_scene_chunk() in order, from `have_bytes` on.
  void scene_ready() { ready_ = true, beat_at_ = now_; }
  void fetch_scene(std::uint64_t have_bytes);
  std::optional<BlobChunk> take_scene_chunk();

  std::optional<Job> take_job();  // leases queue here until asked for
  void finished(JobResult result);
  void set_progress(std::optional<Running> running, std::uint64_t resident_bytes) {
    running_ = running;
    resident_bytes_ = resident_bytes;
  }
  bool cancelled(LeaseId lease) const { return lease == cancelled_; }

  void drain();  // finish what runs, then leave
  const std::optional<Leaving>& leaving() const { return leaving_; }
  bool welcomed() const { return session_ != 0; }
  bool busy() const { return running_.has_value() || !jobs_.empty() || !results_.empty(); }
  std::size_t unacknowledged() const { return results_.size(); }

 private:
  struct Kept {
    JobResult result;
    Digest digest;  // of its data
    Millis offer_again{};
    std::uint64_t sent = 0, credit = 0;  // chunks
    bool offered = false;                // waits for its turn, or is on its way
    bool known = true;                   // its lease, to the coordinator of this session
  };
  // A blob that is being fetched, in order.
  struct Fetch {
    Digest digest;
    std::uint64_t total = 0, received = 0, asked = 0;  // bytes
  };

  void greet();
  void send(Message message);
  void on_welcome(const Envelope& envelope, const Welcome& welcome);
  void on_reject(const Reject& reject);
  void on_job(Job job);
  void on_ack(const ResultAck& ack);
  void on_blob(BlobChunk chunk);
  void request_parent();
  void offer(LeaseId lease, Kept& kept);
  void begin_upload();
  void go_on_with_upload();
  void on_credit(const ChunkCredit& credit);
  void fetch(const Digest& digest, std::uint64_t total, std::uint64_t have);
  void ask_more();
  void look_for_hang();
  void forget(LeaseId lease);
  void leave(int exit_code, std::string text);

  Hello hello_;
  Millis now_;
  Millis greet_at_{0}, beat_at_{0}, ask_again_{0};
  std::optional<Fetch> fetch_;
  Millis heartbeat_{2'000};
  std::uint64_t session_ = 0, epoch_ = 0;
  std::uint32_t minor_ = 0;
  bool ready_ = false, draining_ = false, draining_said_ = false;
  std::optional<Welcome> welcome_, scene_request_;
  std::optional<BlobChunk> scene_chunk_;
  std::deque<Job> jobs_;
  Bytes parent_bytes_;               // of the first job's first parent that is still a digest
  std::map<LeaseId, Kept> results_;  // not acknowledged yet
  std::deque<LeaseId> uploads_;      // of those, in the order of offering; the first is on its way
  std::optional<Running> running_;
  std::vector<CellKey> running_cells_;
  bool running_known_ = true;  // to the coordinator of this session
  std::uint64_t resident_bytes_ = 0;
  std::optional<LeaseId> cancelled_;
  std::uint64_t cancelled_progress_ = 0;
  Millis cancelled_at_{};  // or when it last advanced
  std::deque<Message> outbox_;
  std::optional<Leaving> leaving_;
};

}  // namespace pvsfarm

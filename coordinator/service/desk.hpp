// The coordinator's side of the exchange, without sockets and clocks: takes messages and the time,
// gives messages. Sessions, leases, results, acknowledgements after the commit, blobs, status. What
// is in the tasks is the concern of the work (work.hpp).
// The service drives it with a Router and a journal; the simulation with neither.
// Threads: one.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/base/log.hpp"
#include "common/wire/codec.hpp"
#include "common/wire/roles.hpp"
#include "coordinator/board/board.hpp"
#include "coordinator/service/credit_pool.hpp"
#include "coordinator/service/events.hpp"
#include "coordinator/service/lease_owners.hpp"
#include "coordinator/service/work.hpp"

namespace pvsfarm {

struct DeskLimits {
  Millis heartbeat{2'000};
  Millis suspect{10'000};   // silent so long: given nothing more
  Millis lost{60'000};      // silent so long: forgotten
  Millis cut_off{500};      // after the deadline: for what is on its way
  Millis commit_delay{20};  // of the oldest result that waits for its commit
  std::size_t commit_rows = 64;
  Millis disk_full_retry{4'000};
  std::size_t sessions = 4096;
  std::uint64_t incoming_bytes = kMaxResultBytes;  // of all results on their way in
  std::size_t held_results = 16'384;               // complete, while the work is paused
  Millis upload_stalls{30'000};                    // a result that stays away is given up
  std::size_t blob_chunks = 1024;                  // on their way out, to all workers
  BoardLimits board;
};

struct DeskSettings {
  EvaluatorSettings evaluator;
  Digest scene_digest;
  std::span<const std::byte> scene;  // the bundle, for workers that fetch it
  std::string scene_path;            // where workers of this machine may find it; "" for nowhere
  int algorithm_version = kAlgorithmVersion;
  std::string pinned_kernel;       // whose results the journal holds; "" for none yet
  std::string output;              // for the status
  std::uint64_t epoch = 1;         // drawn at the start; not 0
  std::optional<Millis> deadline;  // then what is not done stays undone
  FarmEvents* events = nullptr;    // outlives the desk
  DeskLimits limits;
};

inline std::string worker_name(const Hello& hello) {
  return "worker " + hello.host + ":" + std::to_string(hello.pid);
}

struct Outgoing {
  std::string peer;
  Envelope envelope;
  Message message;
};

class Desk {
 public:
  // `work` outlives the desk.
  Desk(DeskSettings settings, Work& work, Millis now);

  // `role`: what the peer's key allows it. Errors (fatal): those of the work.
  Status receive(const std::string& peer, const Result<Decoded>& decoded, Millis now,
                 Role role = Role::kLocal);
  Status tick(Millis now);  // after every few messages, and not later than next_wake()
  std::vector<Outgoing> take_outgoing();
  Millis next_wake(Millis now) const;

  void gone(const std::string& peer);        // its connection is no more
  void worker_exited(std::uint32_t pid);     // a process of this machine has ended
  void stop_leasing() { leasing_ = false; }  // for a drain or an interrupt
  void say_shutdown();                       // to every worker

  bool done() const;
  bool quiet() const { return board_.leased_count() == 0 && work_.uncommitted() == 0; }
  bool drain_asked() const { return drain_asked_; }
  bool cancel_asked() const { return cancel_asked_; }
  const std::string& pinned_kernel() const { return settings_.pinned_kernel; }
  std::size_t session_count() const { return sessions_.size(); }
  std::uint64_t workers_seen() const { return last_worker_; }
  std::uint64_t copies() const { return board_.copies(); }
  StatusReport status(Millis now);
  std::vector<std::string> take_warnings();  // the texts of what went wrong, without the news
  std::vector<LogEvent> take_news() { return std::exchange(news_, {}); }

 private:
  struct Incoming {
    WorkResult result;
    std::uint64_t bytes = 0;    // announced
    std::uint64_t granted = 0;  // chunks that may have been sent; 0: waits for its turn
    bool on_credit = false;
    bool broken = false;
    Millis touched{};
  };
  struct Held {  // complete, but the work is paused
    std::string peer;
    WorkerId worker{};
    WorkResult result;
  };
  struct Session {
    WorkerId worker{};
    MachineId machine{};
    std::uint64_t token = 0;
    std::uint32_t minor = 0;
    Hello hello;
    Millis heard{}, sent{};
    struct Given {
      BoardLease lease{};
      CellKey first;
      std::uint32_t cells = 0;
      Millis since{};  // the first of them runs, the others wait
    };
    std::vector<Given> tasks;
    Millis joined{};
    bool draining = false;
    std::uint64_t failures = 0;
    bool ready = false;
    std::uint64_t cells_done = 0;
    std::uint64_t resident_bytes = 0;
    std::unique_ptr<Incoming> incoming;
    std::size_t blob_chunks = 0;  // on their way to it, as far as one can know
    Millis blob_asked{};
  };
  struct Block {
    std::string why;
    StatusReport::Worker was;  // what is still told of it; of a machine: only its host
  };
  struct BlobAsked {
    std::string peer;
    BlobGet get;
  };
  struct PendingAck {
    std::string peer;
    ResultAck ack;
  };

  void reply(const std::string& peer, Message message);
  void reject(const std::string& peer, RejectCode code, std::string text);
  void drop(const std::string& peer, Board::Parting parting, Millis now);
  void warn(std::string event, std::string text, const Session* session = nullptr,
            BoardLease lease = {}, std::string cell = "");
  void tell(LogEvent news);

  void on_hello(const std::string& peer, const Hello& hello, Millis now);
  std::string refusal(const Hello& hello, RejectCode& code) const;
  std::string block_of(const Hello& hello) const;  // "" for none
  static RejectCode blocked_code(const Hello& hello);
  WorkerId identity_of(const Hello& hello);
  Status dispatch(const std::string& peer, Session& session, const Message& message, Millis now);
  Status on_heartbeat(const std::string& peer, Session& session, const Heartbeat& beat, Millis now);
  bool foreign(const std::string& peer, const Session& session, LeaseId lease, Millis now);
  void on_begin(Session& session, LeaseId lease, std::uint64_t bytes,
                std::variant<ResultBegin, FindingBegin> head, Millis now);
  void on_chunk(const std::string& peer, Session& session, const ResultChunk& chunk, Millis now);
  void forget_incoming(Session& session);
  void give_credit(Millis now);
  Status take_held(Millis now);
  Status on_end(const std::string& peer, Session& session, const ResultEnd& end, Millis now);
  Status take(const std::string& peer, WorkerId worker, const WorkResult& result, Millis now);
  void on_failed(Session& session, const TaskFailed& failed, Millis now);
  void on_control(ControlKind kind, Millis now);
  void on_blob_get(const std::string& peer, Session& session, const BlobGet& get, Millis now);
  void send_blob(const std::string& peer, const BlobGet& get);
  void send_blobs();
  void forget_blobs(Millis now);
  void blobs_arrived(Session& session, std::size_t still_on_their_way);

  Status hand_out(const std::string& peer, Session& session, Millis now);
  bool giving() const { return leasing_ && !paused_since_ && !work_.disk_full(); }
  void count_done(const WorkAnswer& answer);
  void end_task(Session& session, BoardLease lease, FarmEvents::End end, Millis now,
                std::span<const WorkAnswer::Done> done = {}, const std::string& text = "");
  void tell_queue() const;
  StatusReport::Worker worker_status(const Session& session, Millis now) const;
  Status feed_hungry(Millis now);
  void cancel_superseded();
  void turn_out_blocked();
  void turn_out(const Board::Blocked& whom, const std::string& text);
  void open_more();
  void cut_off(Millis now);
  Status commit_if_due(Millis now);
  Status commit(Millis now);
  void look_after_sessions(Millis now);

  DeskSettings settings_;
  Work& work_;
  Board board_;
  LeaseOwners owners_;
  std::vector<WorkAnswer::Wrong> wrong_;  // to be turned out
  SetShelf shelf_;
  Digest kernel_id_;  // valid once a kernel is pinned
  std::unordered_map<std::string, Session> sessions_;
  std::map<WorkerId, std::string> peers_;
  std::set<std::string> hungry_;  // could have had a task, but none was pending
  std::vector<Outgoing> outgoing_;
  std::vector<PendingAck> acks_;
  std::vector<LogEvent> news_;
  std::string last_error_;
  Millis start_{}, oldest_uncommitted_{};
  Millis commit_again_{};             // not before that, while the disk is full
  std::optional<Millis> cut_off_at_;  // the deadline has passed
  Millis ticked_{};
  Millis next_spare_look_{};
  Millis next_session_look_{};
  CreditPool credit_;
  std::deque<Held> held_;
  std::deque<BlobAsked> blobs_asked_;
  std::size_t blob_chunks_ = 0;  // on their way out
  std::map<WorkerUuid, WorkerId> identities_;
  std::map<std::string, MachineId> machines_;  // by the host's name
  std::map<WorkerId, Block> blocked_workers_;
  std::map<MachineId, Block> blocked_machines_;
  std::uint64_t last_worker_ = 0, last_token_ = 0;
  FarmCounters counters_;
  std::array<std::uint64_t, kCellSecondsBounds.size() + 1> cell_seconds_{};
  double cpu_s_ = 0;  // of all cells done
  std::optional<Millis> paused_since_;
  Millis paused_{0};  // in all, before that
  bool leasing_ = true;
  bool drain_asked_ = false, cancel_asked_ = false;
};

}  // namespace pvsfarm

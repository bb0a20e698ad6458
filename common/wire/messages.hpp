// The messages of the farm as plain data (proto/farm.proto is their form on the wire), and the caps
// on everything in them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/base/digest.hpp"
#include "common/base/ids.hpp"
#include "common/cells/cell.hpp"
#include "common/pvs/delta.hpp"
#include "common/pvs/kernel.hpp"
#include "common/pvs/settings.hpp"

namespace pvsfarm {

inline constexpr std::uint32_t kProtocolMajor = 2;
inline constexpr std::uint32_t kProtocolMinorLowest = 0;
inline constexpr std::uint32_t kProtocolMinorHighest = 1;

inline constexpr std::size_t kMaxHeaderBytes = 4 * 1024;
inline constexpr std::size_t kMaxBodyBytes = 1024 * 1024;
inline constexpr std::size_t kChunkBytes = 256 * 1024;  // of a blob or a result
// Since minor version 1 a result over kFreeResultBytes waits for CHUNK_CREDIT.
inline constexpr std::uint32_t kMinorWithCredit = 1;
inline constexpr std::uint64_t kFreeResultBytes = 32 * 1024;
inline constexpr std::uint64_t kCreditChunks = 8;  // on their way, a worker and direction
inline constexpr std::size_t kMaxTaskCells = 256;
inline constexpr std::size_t kMaxInquirySets = 2 * kMaxTaskCells;
inline constexpr std::size_t kMaxInlineParentBytes = 512 * 1024;  // of a task; the rest by digest
inline constexpr std::size_t kMaxResultBytes = 256 * 1024 * 1024;
inline constexpr std::size_t kMaxTextBytes = 2048;
inline constexpr std::size_t kMaxSlots = 256;
inline constexpr std::size_t kMaxRunning = 1024;  // leases in one heartbeat
inline constexpr std::size_t kMaxReportedWorkers = 3072;
inline constexpr std::size_t kMaxNamedCells = 20;  // that were given up, in a status

using WorkerUuid = std::array<std::uint8_t, 16>;
using Bytes = std::vector<std::byte>;
// Given by the coordinator, never used twice in one epoch.
enum class LeaseId : std::uint64_t {};

struct Hello {
  std::uint32_t major = kProtocolMajor;
  std::uint32_t minor_lowest = kProtocolMinorLowest, minor_highest = kProtocolMinorHighest;
  std::string build;  // for people; never compared
  Kernel kernel;
  std::uint32_t slots = 1;  // [limit] 1 .. kMaxSlots
  WorkerUuid worker{};
  std::string host;
  std::uint32_t pid = 0;
};

struct Welcome {
  std::uint32_t minor = 0;
  EvaluatorSettings settings;
  Digest scene;
  std::uint64_t scene_bytes = 0;
  std::string scene_path;  // may be ""; only a hint: the digest decides
  Digest kernel_id;
  std::uint32_t heartbeat_ms = 2000;
};

enum class RejectCode {
  kProtocol = 1,
  kKernel,
  kUnknownSession,
  kBadMessage,
  kBadResult,
  kFull,
  kBlocked,
  kForbidden = 35
};
struct Reject {
  RejectCode code = RejectCode::kProtocol;
  std::string text;
};

// The set of objects a cell's evaluation starts from: exactly one of the three.
struct ParentSet {
  bool all = false;             // every occludee of the scene
  Bytes set;                    // canonical bytes
  Digest digest;                // of canonical bytes that BLOB_GET delivers
  std::uint64_t set_bytes = 0;  // with digest
};
struct TaskCell {
  CellKey key;
  Cell cell;
  std::uint32_t parent = 0;  // into Task::parents
};
struct Task {
  LeaseId lease{};
  std::uint32_t attempt = 0;
  std::vector<ParentSet> parents;
  std::vector<TaskCell> cells;                // [limit] 1 .. kMaxTaskCells
  std::optional<EvaluatorSettings> settings;  // of this task alone; none: those of WELCOME
};

// Questions beside the evaluation of cells (common/pvs/inquiry.hpp): audits, or one explanation.
struct AuditAsked {
  CellKey key;
  Cell cell;
  std::uint32_t visible = 0, suspects = 0;  // into Inquiry::sets
  std::uint64_t seed = 0, rays = 0;
};
struct ExplainAsked {
  CellKey key;
  Cell cell;
  std::uint32_t parent = 0;  // into Inquiry::sets
  ObjectId object{};
};
struct Inquiry {
  LeaseId lease{};
  std::uint32_t attempt = 0;
  std::vector<ParentSet> sets;
  std::vector<AuditAsked> audits;  // [limit] kMaxTaskCells; none with `explain`
  std::optional<ExplainAsked> explain;
};

// The progress of a lease that is computed: its result waits to be sent or acknowledged.
inline constexpr std::uint64_t kProgressComputed = 1ull << 63;
struct Heartbeat {
  struct Running {
    LeaseId lease{};
    std::uint64_t progress = 0;
    std::vector<CellKey> cells;  // only of a lease that this coordinator has not renewed yet
  };
  std::vector<Running> running;
  std::uint64_t resident_bytes = 0;
  bool ready = false;  // the scene is there: tasks are welcome
};
struct HeartbeatAck {
  std::vector<LeaseId> renewed, cancelled;
};

struct DeltaHead {
  CellKey key;
  std::uint64_t hidden_bytes = 0, seen_bytes = 0;
  std::uint64_t point_triangles = 0;
  CellStatistics statistics;
  std::uint64_t hint_bytes = 0;  // 0: no hints
  std::uint64_t set_bytes() const { return hidden_bytes + seen_bytes + hint_bytes; }
};
struct ResultBegin {
  LeaseId lease{};
  std::uint64_t bytes = 0;  // of each delta the hidden set, the seen one, the hints
  std::vector<DeltaHead> deltas;
};
// The answers to the first questions of an inquiry; their bytes (finding_bytes.hpp) follow in
// RESULT_CHUNKs.
struct FindingHead {
  std::uint64_t bytes = 0;
  double cpu_ms = 0;
};
struct FindingBegin {
  LeaseId lease{};
  std::uint64_t bytes = 0;  // of all of them
  std::vector<FindingHead> findings;
};
struct ResultChunk {
  LeaseId lease{};
  std::uint64_t offset = 0;
  Bytes data;
};
struct ResultEnd {
  LeaseId lease{};
  Digest digest;
};
struct ChunkCredit {
  LeaseId lease{};
  std::uint64_t chunks = 0;  // that may have been sent since RESULT_BEGIN
};
enum class ResultOutcome { kMerged = 1, kDuplicate, kStale, kResend, kMismatch };
struct ResultAck {
  LeaseId lease{};
  ResultOutcome outcome = ResultOutcome::kMerged;
};

enum class FailureKind { kTransient = 1, kDeterministic, kResource };
struct TaskFailed {
  LeaseId lease{};
  FailureKind kind = FailureKind::kTransient;
  std::string text;
};

struct BlobGet {
  Digest digest;
  std::uint64_t offset = 0;
};
struct BlobChunk {
  Digest digest;
  std::uint64_t offset = 0;
  std::uint64_t total_bytes = 0;  // 0: the coordinator has no such blob
  Bytes data;
};

struct Cancel {
  std::vector<LeaseId> leases;
};
struct Drain {};
struct Draining {};
struct Bye {};
struct Shutdown {};

struct StatusGet {};
// What happened since the coordinator was started; they only grow.
struct FarmCounters {
  std::uint64_t tasks = 0, results = 0, duplicates = 0, stale = 0, mismatches = 0, resends = 0;
  std::uint64_t failed_transient = 0, failed_deterministic = 0, failed_resource = 0;
  std::uint64_t leases_expired = 0;
  std::uint64_t workers_joined = 0, workers_lost = 0, workers_refused = 0;
  std::uint64_t commits = 0, splits = 0;
};
// Upper bounds, in seconds of processor time, of the classes that cells are counted in; one more
// class has what is above.
inline constexpr std::array<double, 12> kCellSecondsBounds{0.001, 0.003, 0.01, 0.03, 0.1, 0.3,
                                                           1,     3,     10,   30,   100, 300};
struct StatusReport {
  struct Worker {
    std::string host;
    std::uint32_t pid = 0;
    std::uint64_t cells_done = 0;
    std::uint32_t leases = 0;
    std::uint64_t silent_ms = 0;
    std::uint64_t resident_bytes = 0;
    std::string build;
    std::string state;                // "computing", "idle", "preparing", "draining", "suspect"
    std::string running;              // the first cell of what it computes
    std::uint32_t running_cells = 0;  // of that task; 0: computes nothing
    std::uint64_t running_ms = 0, connected_ms = 0;
    std::uint64_t failures = 0;  // tasks that failed or ran out of time with it
    std::uint64_t number = 0;    // of the session, from 1
  };
  std::string output;
  std::string state;  // "running", "paused", "draining"
  std::uint64_t cells_done = 0, cells_open = 0;
  double cells_expected = 0;  // done + open + what splitting is expected to add
  double cells_per_second = 0;
  double eta_s = -1;  // negative: not known yet
  std::uint64_t result_bytes = 0;
  std::uint64_t elapsed_ms = 0;
  std::string last_error;
  std::vector<Worker> workers;
  std::uint64_t cells_leased = 0, cells_resumed = 0, cells_quarantined = 0;
  std::vector<std::string> quarantined;  // the first kMaxNamedCells of them, by name
  std::uint64_t journal_bytes = 0;
  double eta_low_s = -1, eta_high_s = -1;  // around eta_s; negative: not known yet
  FarmCounters counters;
  std::array<std::uint64_t, kCellSecondsBounds.size() + 1> cell_seconds{};
  double cpu_s = 0;                  // processor time of all cells of this run
  std::uint64_t resident_bytes = 0;  // of the coordinator
};
enum class ControlKind { kDrain = 1, kCancel, kPause, kResume };
struct Control {
  ControlKind kind = ControlKind::kDrain;
};
struct ControlAck {};

using Message = std::variant<Hello, Welcome, Reject, Task, Heartbeat, HeartbeatAck, ResultBegin,
                             ResultChunk, ResultEnd, ResultAck, TaskFailed, BlobGet, BlobChunk,
                             Cancel, Drain, Draining, Bye, Shutdown, StatusGet, StatusReport,
                             Control, ControlAck, Inquiry, FindingBegin, ChunkCredit>;

// What a header says beside the type and the checksum.
struct Envelope {
  std::uint32_t minor = 0;
  std::uint64_t session = 0;  // given with WELCOME; 0 before
  std::uint64_t epoch = 0;    // drawn by a coordinator at its start
  std::uint64_t sequence = 0;
};

}  // namespace pvsfarm

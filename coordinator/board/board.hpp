// The task board: which worker holds which cells, and for how long. A pure state machine: no clock,
// no messages; whoever calls tells the time and acts on the answers.
//
//   pending --lease()--> leased --complete()--> done (forgotten)
//      ^                    |
//      +--- expire(), leave(), fail(), a result that misses the cell
//
// Execution is at least once: a lease that ran out may still bring its result, and the cell is
// completed by whichever result comes first. Merging exactly once is the merger's concern.
// Threads: one.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <unordered_map>
#include <vector>

#include "common/base/ids.hpp"
#include "coordinator/tree/tree.hpp"

namespace pvsfarm {

using Millis = std::chrono::milliseconds;  // since any fixed instant, where it is a time
enum class WorkerId : std::uint64_t {};
enum class BoardLease : std::uint64_t {};

struct BoardLimits {
  Millis lease{30'000};                 // without progress; doubled with each attempt at a cell
  double task_ms = 200;                 // what a task should last at least
  std::size_t task_cells = 256;         // at most
  std::size_t leases_per_slot = 2;      // one running, one waiting at the worker
  unsigned attempts = 11;               // then a cell is given up: the first, and 10 retries
  unsigned deterministic_failures = 3;  // or so many that a worker says will come again
};

struct BoardTask {
  BoardLease lease{};
  unsigned attempt = 0;        // 0: the first
  std::vector<CellKey> cells;  // neighbours in canonical order
};

class Board {
 public:
  // Leases are numbered from `first_lease`: a coordinator that starts again must not use the
  // numbers of its predecessor, whose results may still arrive.
  explicit Board(const BoardLimits& limits = {}, std::uint64_t first_lease = 1)
      : limits_(limits), next_lease_(first_lease) {}

  void add(const CellKey& key);  // an open cell
  void join(WorkerId worker, unsigned slots);
  void stop_leasing(WorkerId worker);  // it drains: what it holds stays with it
  enum class Parting { kLost, kGraceful };
  void leave(WorkerId worker, Parting parting);  // its cells are pending again

  // The next cells for a worker, or none: it holds enough, or nothing is pending.
  // A cell that failed before goes alone, so that it fails alone.
  // `together`: whether a cell may follow the first of a task.
  using Together = std::function<bool(const CellKey& first, const CellKey& next)>;
  std::optional<BoardTask> lease(WorkerId worker, Millis now, const Together& together = nullptr);
  // What a worker says it has. Progress grows while it computes; 0: not begun, which is renewed by
  // the advance of what runs before it: tell of that first. False: the lease is not held (any
  // more).
  bool renew(BoardLease lease, std::uint64_t progress, Millis now);
  // What a worker has is all in `still`: leases that ran out and are not in it no longer count.
  void release_expired(WorkerId worker, const std::set<BoardLease>& still);
  // A cell is done, through this lease or any other or none.
  void complete(const CellKey& key, double cost_ms);
  // The worker has nothing more to say of a lease; what is not complete is pending again.
  void finish(BoardLease lease);
  enum class Failure { kReturned, kTransient, kDeterministic };
  void fail(BoardLease lease, Failure failure);
  // Takes back what was not renewed in time. Returns the leases, to be cancelled at their workers.
  std::vector<BoardLease> expire(Millis now);

  // Forgets every cell. Returns the leases that ran, to be cancelled at their workers.
  std::vector<BoardLease> clear();

  // Cells that failed too often since the last call: no longer on the board.
  std::vector<CellKey> take_given_up();

  bool holds(BoardLease lease) const { return leases_.count(lease) != 0; }
  std::optional<WorkerId> holder(BoardLease lease) const;
  std::size_t pending_count() const { return pending_.size(); }
  std::size_t leased_count() const { return leased_.size(); }
  std::size_t lease_count(WorkerId worker) const;
  bool idle() const { return pending_.empty() && leased_.empty(); }
  std::optional<Millis> next_expiry() const;

 private:
  struct Lease {
    WorkerId worker{};
    std::vector<CellKey> cells;  // [0, expired) gone: empty once it ran out
    std::uint64_t progress = 0;
    Millis duration{};
    Millis expires{};
    bool expired = false;  // held only to know that its worker is still busy with it
  };
  struct Worker {
    unsigned slots = 1;
    bool draining = false;
    Millis advanced{};  // when it last made progress
    std::set<BoardLease> leases;
  };
  struct Trouble {
    unsigned attempts = 0;
    unsigned deterministic = 0;
  };

  std::size_t batch_size() const;
  void give_back(Lease& lease, Failure failure);
  void close(BoardLease id);

  BoardLimits limits_;
  std::uint64_t next_lease_;
  double cost_ms_ = 0;  // moving mean of a cell; 0: none completed yet
  double slowest_ms_ = 0;
  std::size_t slots_ = 0;  // of all workers
  std::set<CellKey> pending_;
  std::unordered_map<CellKey, BoardLease, CellKeyHash> leased_;
  std::unordered_map<CellKey, Trouble, CellKeyHash> trouble_;
  std::map<BoardLease, Lease> leases_;
  std::map<WorkerId, Worker> workers_;
  std::vector<CellKey> given_up_;
};

}  // namespace pvsfarm

// The task board: which worker holds which cells, and for how long. A pure state machine: no clock,
// no messages; whoever calls tells the time and acts on the answers.
//
//   pending --lease()--> leased --complete()--> done (forgotten)
//      ^                    |
//      +--- expire(), leave(), fail(), a result that misses the cell
//
// Execution is at least once: a lease that ran out may still bring its result, and the cell is
// completed by whichever result comes first. Merging exactly once is the merger's concern.
//
// Source of the numbers: docs/protocol.md, "Leases". A step is the evaluation of one cell.
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
#include "coordinator/board/conduct.hpp"
#include "coordinator/board/step_times.hpp"
#include "coordinator/board/task_order.hpp"
#include "coordinator/tree/tree.hpp"

namespace pvsfarm {

using Millis = std::chrono::milliseconds;  // since any fixed instant, where it is a time
enum class WorkerId : std::uint64_t {};    // the same after a reconnect; newer ones are greater
enum class MachineId : std::uint64_t {};
enum class BoardLease : std::uint64_t {};

struct BoardLimits {
  Millis lease{30'000};  // no word of it from its worker
  // Of words without progress, and of a lease in all from its first progress on: at least so long,
  // or so many of the steps that 95 % stay below. Doubled with each attempt at a cell.
  Millis stall{30'000};
  int stall_steps = 4;
  Millis deadline{60'000};
  int deadline_steps = 10;
  double task_ms = 200;             // what a task should last at least
  std::size_t task_cells = 256;     // at most
  std::size_t leases_per_slot = 2;  // one running, one waiting at the worker
  unsigned attempts = 11;           // then a cell is given up: the first, and 10 retries
  std::size_t failed_on = 3;        // or so many workers that say it will fail again
  unsigned short_of_memory = 5;     // or so many times alone, wherever that was
  Millis pause{250};                // before a second retry; doubled with each, up to
  Millis longest_pause{2'000};      // (four times as long where memory was short)
  Millis speculate_after{200};      // at least, before a lease is copied or moved
  ConductLimits conduct;
  TaskOrder order;
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
      : limits_(limits), next_lease_(first_lease), fresh_(limits.order) {}

  void add(const CellKey& key);  // an open cell
  // A cell to be done once more, by another worker than that if there is one.
  void add_again(const CellKey& key, WorkerId avoid);
  void join(WorkerId worker, unsigned slots, MachineId machine = {});
  void stop_leasing(WorkerId worker);  // it drains: what it holds stays with it
  enum class Parting { kLost, kGraceful };
  // Its cells are pending again; those it ran when it was lost have one attempt more.
  void leave(WorkerId worker, Parting parting, Millis now = {});

  // The next cells for a worker, or none: it holds enough, or there is nothing for it.
  // A cell that failed before goes alone, to a worker that has nothing else, so that it fails
  // alone. Where nothing is pending, an idle worker gets a straggler's: what waits there is moved
  // to it, what runs there is copied, once. `together`: whether a cell may follow the first.
  using Together = std::function<bool(const CellKey& first, const CellKey& next)>;
  std::optional<BoardTask> lease(WorkerId worker, Millis now, const Together& together = nullptr);
  // Cells that a worker says it computes since before this board was made, or since before it was
  // thought lost. False: none of them is pending.
  bool adopt(WorkerId worker, BoardLease lease, const std::vector<CellKey>& cells, Millis now);
  // What a worker says it has. Progress grows while it computes; 0: not begun, which is renewed by
  // the advance of what runs before it: tell of that first. False: the lease is not held (any
  // more).
  bool renew(BoardLease lease, std::uint64_t progress, Millis now);
  // The same for a lease whose result is complete: it lasts as long as its worker says so.
  bool renew_computed(BoardLease lease, Millis now);
  // What a worker has is all in `still`: leases that ran out and are not in it no longer count.
  void release_expired(WorkerId worker, const std::set<BoardLease>& still);
  // How many times longer the lease took until now than its result says it cost; at least 1.
  double stretch(BoardLease lease, double cost_ms, Millis now) const;
  // A cell need not be done any more.
  void withdraw(const CellKey& key);
  // A cell is done, through this lease or any other or none.
  void complete(const CellKey& key, double cost_ms, double stretch = 1);
  void did_well(WorkerId worker);  // it completed something
  // The worker has nothing more to say of a lease; what is not complete is pending again.
  void finish(BoardLease lease, Millis now = {});
  enum class Failure { kReturned, kTransient, kDeterministic, kResource };
  void fail(BoardLease lease, Failure failure, Millis now = {});
  // Takes back what was not renewed in time. Returns the leases, to be cancelled at their workers.
  std::vector<BoardLease> expire(Millis now);
  // Leases of which nothing is left, for others did it or have it now: to be cancelled.
  std::vector<BoardLease> take_superseded() { return std::exchange(superseded_, {}); }

  // Forgets every cell. Returns the leases that ran, to be cancelled at their workers.
  std::vector<BoardLease> clear();

  // Cells that failed too often since the last call: no longer on the board.
  std::vector<CellKey> take_given_up() { return std::exchange(given_up_, {}); }
  // Who shall get no more, and why (conduct.hpp), since the last call. Blocked workers are still
  // joined: let them leave.
  struct Blocked {
    std::optional<WorkerId> worker;  // or else
    MachineId machine{};
    std::size_t cells = 0;  // that failed there
  };
  std::vector<Blocked> take_blocked() { return std::exchange(blocked_, {}); }

  bool holds(BoardLease lease) const { return leases_.count(lease) != 0; }
  std::optional<WorkerId> holder(BoardLease lease) const;
  std::size_t pending_count() const { return fresh_.size() + retries_.size(); }
  std::size_t fresh_count() const { return fresh_.size(); }  // never tried
  std::size_t leased_count() const { return leased_.size(); }
  std::size_t lease_count(WorkerId worker) const;
  bool idle() const { return fresh_.empty() && retries_.empty() && leased_.empty(); }
  std::optional<Millis> next_expiry() const;
  std::uint64_t copies() const { return copies_; }  // leases copied so far

 private:
  struct Lease {
    WorkerId worker{};
    std::vector<CellKey> cells;  // not complete yet; empty once it ran out
    std::size_t size = 0;        // cells at first
    unsigned attempt = 0;
    std::uint64_t progress = 0;
    Millis granted{}, heard{}, advanced{};
    std::optional<Millis> began;     // as its worker told
    std::optional<BoardLease> twin;  // its copy, or what it is a copy of
    bool computed = false;           // its result is on its way
    bool copied = false;             // once is enough
    bool expired = false;            // held only to know that its worker is still busy with it
  };
  struct Worker {
    unsigned slots = 1;
    MachineId machine{};
    bool draining = false;
    bool first_time = false;          // not a reconnect
    std::uint64_t losses_before = 0;  // of its machine, when it joined
    Millis advanced{};                // when it last made progress
    Millis finished{};                // when it last ended a lease
    std::set<BoardLease> leases;      // in the order in which it has them
  };
  struct Machine {
    std::uint64_t losses = 0;  // one after the other, with nothing completed in between
    std::set<CellKey> lost_at;
  };
  struct Trouble {
    unsigned attempts = 0, short_of_memory = 0;
    Millis ready_at{};
    std::set<WorkerId> failed_on;  // and to be avoided
    std::set<WorkerId> blames;     // of those, whom it speaks against
  };

  std::size_t batch_size() const;
  BoardTask grant(WorkerId id, Worker& worker, std::vector<CellKey> cells, Millis now);
  std::optional<CellKey> retry_for(WorkerId id, Millis now) const;
  std::optional<BoardTask> spare_for(WorkerId id, Worker& worker, Millis now);
  bool straggles(const Lease& lease, Millis since, Millis now) const;
  std::optional<Millis> running_since(BoardLease id, const Lease& lease) const;
  Millis expiry(const Lease& lease) const;
  void give_back(BoardLease id, Lease& lease, Failure failure, Millis now);
  bool troubled(const CellKey& key, WorkerId worker, bool alone, Failure failure, Millis now);
  void pass_to_twin(BoardLease id, Lease& lease);
  void supersede(BoardLease id, Lease& lease);
  void close(BoardLease id, Millis now);
  void note_lost(const Worker& worker, const CellKey& at);
  void block_if_due(WorkerId id, Conduct& conduct);

  BoardLimits limits_;
  std::uint64_t next_lease_;
  double cost_ms_ = 0;  // moving mean of a cell; 0: none completed yet
  StepTimes steps_;
  Millis median_{}, p95_{};  // of steps_, as of its last few
  std::size_t slots_ = 0;    // of all workers
  WorkerId newest_{};
  std::set<CellKey, TaskOrder> fresh_;
  std::set<CellKey> retries_;
  std::unordered_map<CellKey, BoardLease, CellKeyHash> leased_;
  std::unordered_map<CellKey, Trouble, CellKeyHash> trouble_;
  std::map<BoardLease, Lease> leases_;
  std::map<WorkerId, Worker> workers_;
  std::map<WorkerId, Conduct> conduct_;
  std::map<MachineId, Machine> machines_;
  std::vector<CellKey> given_up_;
  std::vector<BoardLease> superseded_;
  std::vector<Blocked> blocked_;
  Millis next_look_ = Millis::max();  // no lease runs out before
  std::uint64_t copies_ = 0;
};

}  // namespace pvsfarm

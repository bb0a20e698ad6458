// Cells of which two workers brought different results. An evaluation is a pure function, so one
// of them is wrong: a third run decides. Until then, and for good if it decides nothing, the cell's
// row hides only what every answer hides: doubt means visible.
//
//   mismatch ──► row := what all agree on, the cell goes to a third worker
//                 ├─ it agrees with the first   ──► row := the first result, as if nothing had been
//                 ├─ it agrees with the second  ──► row := what these and the first hide
//                 └─ with neither, or it asked one who had answered ──► the row stays as it is
//
// The first result is never widened: cells below it were computed from its set, and what they hide
// stays within what is left of it. A row that hides less can only split where it did not, never the
// other way round; whoever resumes finds the halves open.
// Whoever two others contradict is at fault, and named in the answer.
// Threads: one.
#pragma once

#include <deque>
#include <map>
#include <set>
#include <unordered_map>

#include "coordinator/journal/result_log.hpp"
#include "coordinator/service/work.hpp"
#include "coordinator/tree/tree.hpp"

namespace pvsfarm {

struct DisputeFigures {
  std::uint64_t disputes = 0, for_first = 0, against_first = 0, undecided = 0;
};

class Disputes {
 public:
  // Both outlive this.
  Disputes(const Tree& tree, ResultLog& log) : tree_(tree), log_(log) {}

  // Whose result of a cell was merged, or is equal to the merged one.
  void merged(const CellKey& key, const WorkResult& from);
  // Whether results of this cell are heard here.
  bool holds(const CellKey& key) const { return cases_.count(key) != 0; }
  // A result of a cell that is merged, whose digest differs from the row's, or of one that is held.
  // Errors: kInvalidInput, its worker is at fault; those of the log.
  Status hear(const ResultRow& row, const WorkResult& from, WorkAnswer& answer);
  // What a run of a cell that is held starts from. Errors: those of the log.
  Result<SharedSet> parent_set(const CellKey& key);
  // Nobody could evaluate it a third time.
  void give_up(const CellKey& key);

  const DisputeFigures& figures() const { return figures_; }
  std::vector<CellKey> cells() const;  // that were ever disputed

 private:
  struct Author {
    WorkerId worker{};
    LeaseId lease{};
  };
  struct Run {  // equal results
    Digest digest;
    ResultRow row;
    CellDelta delta;
    std::set<WorkerId> by;
  };
  struct Case {
    std::vector<Run> runs;  // the merged one first
    std::set<LeaseId> leases;
    std::size_t heard = 1;
    bool open = true;
    SharedSet parent;
  };

  Status begin(const CellKey& key, Case& now);
  Status settle(const CellKey& key, Case& now, const Run* decided, WorkAnswer& answer);
  Status write(const CellKey& key, const Case& now, const Run* decided);
  Status check(const CellKey& key, Case& now, const CellDelta& delta);
  Result<std::optional<ResultRow>> row_as_merged(const CellKey& key);

  const Tree& tree_;
  ResultLog& log_;
  std::map<CellKey, Case> cases_;
  std::unordered_map<CellKey, Author, CellKeyHash> authors_;
  std::deque<CellKey> authors_in_order_;
  DisputeFigures figures_;
};

}  // namespace pvsfarm

// Applies deltas to the hierarchy, each cell exactly once, whatever arrives how often in whatever
// order: the first valid delta of a cell wins, later ones are compared with it.
// Threads: one.
#pragma once

#include <span>

#include "coordinator/journal/result_log.hpp"
#include "coordinator/tree/tree.hpp"

namespace pvsfarm {

enum class MergeOutcome {
  kMerged,
  kDuplicate,  // merged before, with the same bytes
  kStale,      // no such cell, now or ever
  kMismatch,   // merged before, with other bytes: two workers disagree
};

struct MergeAnswer {
  MergeOutcome outcome = MergeOutcome::kStale;
  bool split = false;         // kMerged: the cell's children are open now
  std::uint32_t objects = 0;  // kMerged: in the cell's PVS
  std::uint64_t triangles = 0;
};

// Errors: kInvalidInput (bytes that are no sets of so many objects).
Result<CellDelta> decode_row(const ResultRow& row, std::uint32_t object_count);

class Merger {
 public:
  // `tree` and `log` outlive the merger.
  Merger(Tree& tree, ResultLog& log) : tree_(tree), log_(log) {}

  // Errors: kInvalidInput if the delta is no delta of that cell (the worker is at fault; nothing
  // is changed), anything else if the log fails (the coordinator must stop).
  Result<MergeAnswer> apply(const ResultRow& row);
  // The same for a row read back from the log, which must fit an open cell.
  Result<MergeAnswer> replay(const ResultRow& row);

 private:
  bool hints_fit(const CellDelta& delta) const;
  Result<MergeAnswer> merge_open(const ResultRow& row, bool append);

  Tree& tree_;
  ResultLog& log_;
};

}  // namespace pvsfarm

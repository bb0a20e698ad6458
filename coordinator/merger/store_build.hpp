// From the committed rows to the nodes of the store, in canonical order. Siblings that agree are
// merged on the way (sibling_merge.hpp), so the subtree of one root is in memory at a time, packed.
// Threads: one.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "common/pvs/hints_file.hpp"
#include "common/pvs/store_writer.hpp"
#include "coordinator/journal/result_log.hpp"
#include "coordinator/merger/sibling_merge.hpp"
#include "coordinator/tree/tree.hpp"

namespace pvsfarm {

struct StoreFigures {
  std::uint64_t nodes = 0, leaves = 0, quarantined = 0;  // of the store
  std::uint64_t evaluated = 0;                           // cells, merged ones included
  std::uint64_t merged_parts = 0;                        // cells that are no longer in the store
  std::array<std::uint64_t, kLeafReasonCount> leaves_by_reason{};
  // Summed over the leaves.
  std::uint64_t leaf_objects = 0, leaf_triangles = 0, seen_objects = 0, seen_triangles = 0;
  double gap_of_objects = 0, gap_of_triangles = 0;  // of each leaf: (|PVS| - |seen|) / |PVS|
  CostFigures cost;                                 // of all evaluations
  // Objects that a cell saw and both its halves hold for hidden: as bad as a contradiction.
  std::uint64_t refuted = 0;
};

class StoreBuild {
 public:
  // `tree` and `writer` outlive this. `root_ids`: as the cells file gives them, by root.
  // `hints`, if any, outlives it too and is given the hints of every node.
  StoreBuild(const Tree& tree, std::vector<std::int64_t> root_ids, StoreWriter& writer,
             HintsWriter* hints = nullptr);

  // Rows in canonical order. A node without a row was given up: a leaf with its parent's set.
  // Errors: kIo (the writer), kInvalidInput (a row of a cell that splitting does not make).
  Status add(const ResultRow& row);
  Status finish();

  const StoreFigures& figures() const { return figures_; }
  // One JSON line a node, N its number in canonical order; only methods that did anything:
  // {"cell":N,"ms":..,"methods":{"projection":{"hidden":[objects,triangles],"seen":[..],
  // "work":..,"ms":..}},"rounds":[..]}; "parts": the cells merged into it, whose figures are in the
  // sums. Rounds are told in their order, with what they had to work with (round_figures.hpp).
  const std::string& statistics_lines() const { return lines_; }
  // Those since they were taken last: a large store's would fill the memory.
  std::string take_statistics_lines() { return std::exchange(lines_, {}); }

 private:
  struct Expected {
    CellKey key;
    Cell cell;
    VisibleSet parent;
  };
  Status take(Expected expected, const ResultRow* row);
  Status finish_root();
  Status write(SubtreeNode& part);
  Status write_hints(const SubtreeNode& part);
  bool next_expected(Expected& out);

  const Tree& tree_;
  std::vector<std::int64_t> root_ids_;
  StoreWriter& writer_;
  HintsWriter* hints_;
  std::vector<Expected> expected_;  // the nearest last; at most one a depth
  std::vector<SubtreeNode> subtree_;
  std::uint32_t next_root_ = 0;
  StoreFigures figures_;
  std::string lines_;
};

}  // namespace pvsfarm

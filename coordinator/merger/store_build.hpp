// From the committed rows to the nodes of the store, in canonical order, with only the sets on the
// path from the root in memory. Threads: one.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/pvs/store_writer.hpp"
#include "coordinator/journal/result_log.hpp"
#include "coordinator/tree/tree.hpp"

namespace pvsfarm {

struct StoreFigures {
  std::uint64_t nodes = 0, leaves = 0, quarantined = 0;
  std::uint64_t leaf_objects = 0, leaf_triangles = 0;  // summed over the leaves
  double cpu_ms = 0;                                   // of all evaluations
  std::uint64_t contradictions = 0;                    // that the evaluations reported
};

class StoreBuild {
 public:
  // `tree` and `writer` outlive this. `root_ids`: as the cells file gives them, by root.
  StoreBuild(const Tree& tree, std::vector<std::int64_t> root_ids, StoreWriter& writer);

  // Rows in canonical order. A node without a row was given up: a leaf with its parent's set.
  // Errors: kIo (the writer), kInvalidInput (a row of a cell that splitting does not make).
  Status add(const ResultRow& row);
  Status finish();

  const StoreFigures& figures() const { return figures_; }
  // One JSON line a node, {"cell":N,"ms":..}, N its number in canonical order.
  const std::string& statistics_lines() const { return lines_; }

 private:
  struct Expected {
    CellKey key;
    Cell cell;
    VisibleSet parent;
  };
  Status emit(const Expected& expected, const ResultRow* row);
  bool next_expected(Expected& out);

  const Tree& tree_;
  std::vector<std::int64_t> root_ids_;
  StoreWriter& writer_;
  std::vector<Expected> expected_;  // the nearest last; at most one a depth
  std::uint32_t next_root_ = 0;
  StoreFigures figures_;
  std::string lines_;
};

}  // namespace pvsfarm

// Where merged results are made durable. The journal is one; tests have one that forgets.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "common/base/digest.hpp"
#include "common/base/ids.hpp"
#include "common/base/result.hpp"
#include "common/pvs/delta.hpp"

namespace pvsfarm {

// The merged result of one cell: what the final store is made from.
struct ResultRow {
  CellKey key;
  std::vector<std::byte> hidden, seen;  // canonical bytes of the delta's sets
  std::uint64_t point_triangles = 0;
  CellStatistics statistics;
  HintBytes hints;  // may be empty
};

// The identity of a delta: of cell, sets, hints and point_triangles, never of what it cost, and of
// our own bytes, never of Protobuf's.
Digest delta_digest(const ResultRow& row);

class ResultLog {
 public:
  virtual ~ResultLog() = default;
  // The digest of the cell's row, committed or not.
  virtual Result<std::optional<Digest>> find(const CellKey& key) = 0;
  // Requires: no row of the cell yet. Durable only after commit().
  virtual Status append(const ResultRow& row) = 0;
  virtual std::size_t uncommitted() const = 0;
  // The kernel that all rows come from. Durable at once.
  virtual Status set_kernel(const std::string& /*kernel*/) { return {}; }
  // After success every row appended so far survives a crash of the machine.
  virtual Status commit() = 0;
};

}  // namespace pvsfarm

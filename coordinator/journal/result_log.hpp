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

// The disk failed under a running bake: nothing more may be acknowledged, and what was is safe, so
// whoever started the coordinator should start it again. The number of EX_TEMPFAIL.
inline constexpr ErrorKind kDiskFailed{75};

// Errors: kDiskFailed, from whichever call finds out; no further call then.
class ResultLog {
 public:
  virtual ~ResultLog() = default;
  // The digest of the cell's row, committed or not.
  virtual Result<std::optional<Digest>> find(const CellKey& key) = 0;
  // The cell's row, committed or not.
  virtual Result<std::optional<ResultRow>> read(const CellKey& key) = 0;
  // Requires: no row of the cell yet. Durable only after commit().
  virtual Status append(const ResultRow& row) = 0;
  // The same where there is one, which is forgotten.
  virtual Status replace(const ResultRow& row) = 0;
  // Rows that a crash of the machine may still take, those that an earlier process wrote included.
  virtual std::size_t uncommitted() const = 0;
  // The kernel that all rows come from. Durable with the first of them.
  virtual Status set_kernel(const std::string& /*kernel*/) { return {}; }
  // After success every row appended so far survives a crash of the machine; unless the disk is
  // full: then all stays as it was, to be tried again.
  virtual Status commit() = 0;
  virtual bool disk_full() const { return false; }   // at the last commit()
  virtual std::uint64_t bytes() const { return 0; }  // on the disk
};

}  // namespace pvsfarm

// Whether a worker, or a machine, is at fault for what fails on it: cells fail too, and a good
// worker that meets a poison cell must not pay for it. Threads: one.
//
// A worker is blocked when what speaks against it cannot be the cells' doing:
//   * 3 cells failed on it that others completed afterwards, or
//   * 3 cells failed on it, and it never completed any, or
//   * 12 cells in a row failed on it.
// A machine is blocked when 8 of its workers, each started after the one before was lost, were lost
// at different cells and none completed anything in between: a crash loop. Workers that are lost
// together, or come back, are a matter of the network.
// Cells that are given up speak against nobody.
#pragma once

#include <algorithm>
#include <cstdint>
#include <set>

#include "common/base/ids.hpp"

namespace pvsfarm {

struct ConductLimits {
  std::size_t belied = 3;      // cells that others completed
  std::size_t never_good = 3;  // cells, if none was ever completed
  std::size_t in_a_row = 12;
  std::size_t crash_loop = 8;  // cells at which a machine's workers were lost
};

class Conduct {
 public:
  void failed(const CellKey& key) { failed_.insert(key); }
  void belied(const CellKey& key) { belied_.insert(key); }  // another completed it
  void forgive(const CellKey& key) {
    failed_.erase(key);
    belied_.erase(key);
  }
  void completed() {
    failed_.clear();
    good_ = true;
  }
  bool blocked(const ConductLimits& limits) const {
    return belied_.size() >= limits.belied ||
           failed_.size() >= (good_ ? limits.in_a_row : limits.never_good);
  }
  std::size_t failures() const { return std::max(failed_.size(), belied_.size()); }

 private:
  std::set<CellKey> failed_;  // since it last completed one
  std::set<CellKey> belied_;
  bool good_ = false;
};

}  // namespace pvsfarm

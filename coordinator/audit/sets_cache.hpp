// The sets of cells that were read last: a cell's neighbours are read again and again, each time
// through all rows of their group of the store.
// Threads: one.
#pragma once

#include <cstdint>
#include <deque>
#include <unordered_map>

#include "common/pvs/store_reader.hpp"

namespace pvsfarm {

class SetsCache {
 public:
  // `store` outlives the cache, which holds `bytes` of sets at most, and always one cell's.
  SetsCache(StoreReader& store, std::size_t bytes);

  // As StoreReader::sets. The pointer holds until the next call.
  Result<const StoredSets*> sets(std::uint32_t cell);

 private:
  StoreReader& store_;
  std::size_t capacity_;  // cells
  std::unordered_map<std::uint32_t, StoredSets> kept_;
  std::deque<std::uint32_t> oldest_first_;
};

}  // namespace pvsfarm

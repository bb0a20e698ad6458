#include "coordinator/audit/sets_cache.hpp"

#include <algorithm>
#include <utility>

namespace pvsfarm {

SetsCache::SetsCache(StoreReader& store, std::size_t bytes) : store_(store) {
  const std::size_t a_cell = 2 * (store.object_count() / 8 + sizeof(std::uint64_t));
  capacity_ = std::max<std::size_t>(bytes / a_cell, 1);
}

Result<const StoredSets*> SetsCache::sets(std::uint32_t cell) {
  if (const auto found = kept_.find(cell); found != kept_.end()) return &found->second;
  auto read = store_.sets(cell);
  if (!read) return read.error();
  if (kept_.size() == capacity_) {
    kept_.erase(oldest_first_.front());
    oldest_first_.pop_front();
  }
  oldest_first_.push_back(cell);
  return &kept_.emplace(cell, std::move(read).value()).first->second;
}

}  // namespace pvsfarm

#include "coordinator/service/set_shelf.hpp"

namespace pvsfarm {
namespace {
constexpr std::size_t kTidyFrom = 4096;  // entries, of which most are gone
}  // namespace

ParentSet SetShelf::place(const SharedSet& set, std::size_t& inline_bytes) {
  if (!set) return {.all = true};
  if (inline_bytes + set->size() <= kMaxInlineParentBytes) {
    inline_bytes += set->size();
    return {.set = *set};
  }
  if (sets_.size() >= kTidyFrom)
    std::erase_if(sets_, [](const auto& entry) { return entry.second.expired(); });
  const Digest digest = digest_of(*set);
  sets_.emplace(digest, set);
  return {.digest = digest, .set_bytes = set->size()};
}

SharedSet SetShelf::find(const Digest& digest) const {
  const auto [first, last] = sets_.equal_range(digest);
  for (auto at = first; at != last; ++at)
    if (SharedSet set = at->second.lock()) return set;
  return nullptr;
}

}  // namespace pvsfarm

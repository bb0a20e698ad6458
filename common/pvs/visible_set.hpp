// A set of objects that can only shrink: what may be seen from a cell.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/check.hpp"
#include "common/base/ids.hpp"
#include "common/base/result.hpp"

namespace pvsfarm {

class VisibleSet {
 public:
  VisibleSet() = default;
  // Every object of a scene of `object_count`.
  static VisibleSet all(std::uint32_t object_count);
  static VisibleSet none(std::uint32_t object_count);

  std::uint32_t universe() const { return universe_; }
  bool contains(ObjectId id) const {
    const std::uint32_t i = index_of(id);
    return words_[i >> 6] >> (i & 63) & 1;
  }
  bool any_in(std::uint32_t first, std::uint32_t count) const;
  std::uint32_t count() const;
  void remove(ObjectId id) {
    const std::uint32_t i = index_of(id);
    words_[i >> 6] &= ~(std::uint64_t{1} << (i & 63));
  }
  void remove_range(std::uint32_t first, std::uint32_t count);
  void remove_all(const VisibleSet& gone);  // *this := *this minus gone
  void keep_only(const VisibleSet& kept);   // *this := *this and kept
  bool subset_of(const VisibleSet& other) const;

  // Calls f(ObjectId) in ascending order.
  template <class F>
  void for_each(F&& f) const {
    for (std::size_t w = 0; w < words_.size(); ++w)
      for (std::uint64_t bits = words_[w]; bits != 0; bits &= bits - 1)
        f(ObjectId{static_cast<std::uint32_t>(w * 64 + std::countr_zero(bits))});
  }
  // Object i is bit i mod 64 of word i / 64; bits past the universe are 0.
  std::span<const std::uint64_t> words() const { return words_; }
  static VisibleSet from_words(std::uint32_t universe, std::vector<std::uint64_t> words);
  friend bool operator==(const VisibleSet&, const VisibleSet&) = default;

 private:
  std::uint32_t universe_ = 0;
  std::vector<std::uint64_t> words_;
};

// What is neither seen nor hidden, as a share of what is visible: how loose a cell's answer may be.
// 0 where nothing is visible.
inline double gap_of(std::uint64_t visible, std::uint64_t seen) {
  if (seen >= visible) return 0;
  return static_cast<double>(visible - seen) / static_cast<double>(visible);
}

// Canonical compact bytes for messages and the journal (not the store's format): LEB128 of the
// universe, then of the lengths of alternating runs, absent first, present second, ...
std::vector<std::byte> encode(const VisibleSet& set);
// Errors: kInvalidInput (truncated, runs past the universe, trailing bytes, universe over `limit`).
Result<VisibleSet> decode_visible_set(std::span<const std::byte> bytes, std::uint32_t limit);

}  // namespace pvsfarm

#include "common/pvs/visible_set.hpp"

#include <algorithm>
#include <bit>
#include <utility>

namespace pvsfarm {
namespace {

std::uint64_t low_bits(std::uint32_t n) {  // n in 0..64
  return n >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << n) - 1;
}

void put_varint(std::vector<std::byte>& out, std::uint64_t v) {
  for (; v >= 0x80; v >>= 7) out.push_back(static_cast<std::byte>(v | 0x80));
  out.push_back(static_cast<std::byte>(v));
}

bool get_varint(std::span<const std::byte>& in, std::uint64_t& v) {
  v = 0;
  for (int shift = 0; shift < 63; shift += 7) {
    if (in.empty()) return false;
    const auto b = static_cast<std::uint64_t>(in.front());
    in = in.subspan(1);
    v |= (b & 0x7f) << shift;
    if (b < 0x80) return b != 0 || shift == 0;  // one encoding a number
  }
  return false;
}

// The first object from `at` on that is not as `present` says; the universe if all are.
std::uint32_t run_end(const VisibleSet& set, std::uint32_t at, bool present) {
  const auto words = set.words();
  const std::uint64_t flip = present ? ~std::uint64_t{0} : 0;
  std::uint64_t skip = low_bits(at & 63);
  for (std::size_t w = at >> 6; w < words.size(); ++w, skip = 0)
    if (const std::uint64_t others = (words[w] ^ flip) & ~skip; others != 0)
      return std::min(static_cast<std::uint32_t>(w * 64 + std::countr_zero(others)),
                      set.universe());
  return set.universe();
}

}  // namespace

VisibleSet VisibleSet::none(std::uint32_t object_count) {
  VisibleSet set;
  set.universe_ = object_count;
  set.words_.assign((std::size_t{object_count} + 63) / 64, 0);
  return set;
}

VisibleSet VisibleSet::all(std::uint32_t object_count) {
  VisibleSet set = none(object_count);
  for (auto& word : set.words_) word = ~std::uint64_t{0};
  if (object_count % 64 != 0) set.words_.back() = low_bits(object_count % 64);
  return set;
}

VisibleSet VisibleSet::from_words(std::uint32_t universe, std::vector<std::uint64_t> words) {
  PVS_CHECK_EQ(words.size(), (std::size_t{universe} + 63) / 64);
  if (universe % 64 != 0) PVS_CHECK_EQ(words.back() & ~low_bits(universe % 64), 0u);
  VisibleSet set;
  set.universe_ = universe;
  set.words_ = std::move(words);
  return set;
}

bool VisibleSet::any_in(std::uint32_t first, std::uint32_t count) const {
  const std::uint32_t end = first + count;
  for (std::uint32_t i = first; i < end;) {
    const std::uint32_t in_word = i & 63, n = std::min(64 - in_word, end - i);
    if (words_[i >> 6] >> in_word & low_bits(n)) return true;
    i += n;
  }
  return false;
}

std::uint32_t VisibleSet::count() const {
  std::uint32_t n = 0;
  for (const std::uint64_t word : words_) n += static_cast<std::uint32_t>(std::popcount(word));
  return n;
}

void VisibleSet::remove_range(std::uint32_t first, std::uint32_t count) {
  const std::uint32_t end = first + count;
  for (std::uint32_t i = first; i < end;) {
    const std::uint32_t in_word = i & 63, n = std::min(64 - in_word, end - i);
    words_[i >> 6] &= ~(low_bits(n) << in_word);
    i += n;
  }
}

void VisibleSet::remove_all(const VisibleSet& gone) {
  PVS_CHECK_EQ(universe_, gone.universe_);
  for (std::size_t w = 0; w < words_.size(); ++w) words_[w] &= ~gone.words_[w];
}

void VisibleSet::keep_only(const VisibleSet& kept) {
  PVS_CHECK_EQ(universe_, kept.universe_);
  for (std::size_t w = 0; w < words_.size(); ++w) words_[w] &= kept.words_[w];
}

bool VisibleSet::subset_of(const VisibleSet& other) const {
  PVS_CHECK_EQ(universe_, other.universe_);
  for (std::size_t w = 0; w < words_.size(); ++w)
    if (words_[w] & ~other.words_[w]) return false;
  return true;
}

std::vector<std::byte> encode(const VisibleSet& set) {
  std::vector<std::byte> out;
  put_varint(out, set.universe());
  for (std::uint32_t at = 0;;) {
    const std::uint32_t first = run_end(set, at, false);
    if (first == set.universe()) return out;
    const std::uint32_t end = run_end(set, first, true);
    put_varint(out, first - at);
    put_varint(out, end - first);
    at = end;
  }
}

Result<VisibleSet> decode_visible_set(std::span<const std::byte> bytes, std::uint32_t limit) {
  std::uint64_t universe = 0;
  if (!get_varint(bytes, universe) || universe > limit)
    return invalid_input("visible set: damaged or too large");
  VisibleSet set = VisibleSet::none(static_cast<std::uint32_t>(universe));
  std::vector<std::uint64_t> words(set.words().begin(), set.words().end());
  std::uint64_t at = 0;
  while (!bytes.empty()) {
    std::uint64_t absent = 0, present = 0;
    if (!get_varint(bytes, absent) || !get_varint(bytes, present) || absent > universe - at ||
        present == 0 || present > universe - at - absent || (absent == 0 && at != 0))
      return invalid_input("visible set: damaged run lengths");
    at += absent;
    for (const std::uint64_t end = at + present; at < end;) {
      const std::uint64_t in_word = at & 63, n = std::min<std::uint64_t>(64 - in_word, end - at);
      words[at >> 6] |= low_bits(static_cast<std::uint32_t>(n)) << in_word;
      at += n;
    }
  }
  return VisibleSet::from_words(static_cast<std::uint32_t>(universe), std::move(words));
}

}  // namespace pvsfarm

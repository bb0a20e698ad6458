// Identities, each a type of its own.
#pragma once

#include <compare>
#include <cstdint>

namespace pvsfarm {

// An object of the scene, 0-based, in Morton order of the centres of the objects' boxes.
// [limit] 2^31 objects.
enum class ObjectId : std::uint32_t {};
constexpr std::uint32_t index_of(ObjectId id) { return static_cast<std::uint32_t>(id); }

// A node of the cell hierarchy, by what it is and never by when it was made: the position of its
// root in the cells file, and the path of splits from there.
// `path` has a leading 1 bit and then one bit a split (0 = low half, 1 = high half); a root is 1.
// [limit] depth 62. The order is canonical: by root, a node before its children, low before high.
struct CellKey {
  std::uint32_t root = 0;
  std::uint64_t path = 1;

  int depth() const { return 63 - __builtin_clzll(path); }
  CellKey child(int half) const { return {root, path << 1 | static_cast<std::uint64_t>(half)}; }
  CellKey parent() const { return {root, path >> 1}; }
  bool is_root() const { return path == 1; }
  friend bool operator==(const CellKey&, const CellKey&) = default;
  friend std::strong_ordering operator<=>(const CellKey& a, const CellKey& b) {
    if (a.root != b.root) return a.root <=> b.root;
    // Depth-first: compare the paths left-aligned below the leading one; a prefix comes first.
    const int shift_a = 63 - a.depth(), shift_b = 63 - b.depth();
    const std::uint64_t left_a = a.path << shift_a, left_b = b.path << shift_b;
    if (left_a != left_b) return left_a <=> left_b;
    return a.depth() <=> b.depth();
  }
};

}  // namespace pvsfarm

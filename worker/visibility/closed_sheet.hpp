// Whether some of the parts of a surface can be chosen so that they form a sheet without border,
// which a given line crosses an odd number of times.
//
// Source: docs/algorithm.md A.14. A choice is a column of bits, one a part. Every edge asks that
// the bits of the triangles at it sum to 0 modulo 2; the line, that the bits of the parts that it
// crosses oddly sum to 1. Gaussian elimination finds a choice whenever there is one, however many
// triangles meet at an edge: nobody need say who continues whom.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace pvsfarm {

// Threads: one object, one thread. Keeps scratch memory from square to square.
class ClosedSheet {
 public:
  static constexpr std::size_t kMostColumns = 256;
  static constexpr int kMostChoices = 8;

  struct Bits {
    std::array<std::uint64_t, kMostColumns / 64> words{};

    void flip(int i) { words[static_cast<std::size_t>(i) / 64] ^= std::uint64_t{1} << (i % 64); }
    bool test(int i) const {
      return (words[static_cast<std::size_t>(i) / 64] >> (i % 64) & 1) != 0;
    }
    Bits& operator^=(const Bits& o) {
      for (std::size_t w = 0; w < words.size(); ++w) words[w] ^= o.words[w];
      return *this;
    }
    bool any() const { return first() >= 0; }
    int first() const {  // -1: none
      for (std::size_t w = 0; w < words.size(); ++w)
        if (words[w] != 0) return static_cast<int>(64 * w) + std::countr_zero(words[w]);
      return -1;
    }
    bool odd_with(const Bits& o) const {
      std::uint64_t both = 0;
      for (std::size_t w = 0; w < words.size(); ++w) both ^= words[w] & o.words[w];
      return (std::popcount(both) & 1) != 0;
    }
  };

  void begin();
  // The number of a new edge.
  int add_edge() {
    edges_.emplace_back();
    return static_cast<int>(edges_.size()) - 1;
  }
  // Called once for each triangle of the part at the edge. [limit] columns below kMostColumns
  void add_to_edge(int edge, int column) { edges_[static_cast<std::size_t>(edge)].flip(column); }

  // Calls fn(choice) for choices that are closed and crossed oddly: if there are any, for one at
  // least and kMostChoices at most. Uses the edges up.
  template <class Fn>
  void find(const Bits& crossed, Fn&& fn) {
    eliminate();
    Bits free = reduced(crossed);
    for (int k = 0; k < kMostChoices; ++k) {
      const int column = free.first();
      if (column < 0) return;
      free.flip(column);
      fn(choice_with(column));
    }
  }

 private:
  void eliminate();
  Bits reduced(Bits row) const;
  Bits choice_with(int column) const;

  std::vector<Bits> edges_;
  std::vector<Bits> basis_;                          // independent rows
  std::array<std::int16_t, kMostColumns> row_of_{};  // by the first bit of a row of basis_
};

}  // namespace pvsfarm

// Which of the triangles that may be met among some segments form a sheet without border there,
// crossed an odd number of times: such a sheet blocks all of the segments.
//
// Source: docs/algorithm.md A.14. Triangles that share an edge that no third has are chosen
// together or not at all: they are one part. Parts that meet three or more at an edge go to
// ClosedSheet.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "worker/visibility/closed_sheet.hpp"
#include "worker/visibility/surface_chain.hpp"

namespace pvsfarm {

// Threads: one object, one thread. Keeps scratch memory from search to search.
class SheetFinder {
 public:
  static constexpr float kNoDepth = -std::numeric_limits<float>::infinity();
  struct Active {
    std::uint32_t triangle;
    std::uint32_t parent = 0;  // within the list; the root stands for the part. At first: itself
    bool cut = false;          // cannot be chosen
    // Of a root, for its part:
    bool spoiled = false;  // cannot be chosen
    bool odd = false;      // crossed so often
    int column = -1;
    float depth = kNoDepth;  // the greatest
  };

  void begin(const SurfaceChain& chain);
  // A new family of segments: no edge is met.
  void next() { ++search_; }
  void meet(std::uint32_t edge) { use_of_[edge] = {.search = search_}; }
  bool met(std::uint32_t edge) const { return use_of_[edge].search == search_; }

  // `active` has every triangle with an edge that is met. `crossing(i)`: whether one of the
  // segments crosses that of active[i]; none: doubt. `depth_of(i)`: any figure of it. Calls
  // offer(depth) with the greatest of each sheet found: if there is any, at least once.
  template <class Crossing, class DepthOf, class Offer>
  void find(std::span<Active> active, Crossing&& crossing, DepthOf&& depth_of, Offer&& offer) {
    join_pairs(active);
    for (std::uint32_t i = 0; i < active.size(); ++i) {
      Active& part = active[root(active, i)];
      if (part.spoiled) continue;
      const auto crossed = crossing(i);
      part.spoiled = !crossed;
      part.odd = part.odd != crossed.value_or(false);
      part.depth = std::max(part.depth, depth_of(i));
    }
    make_columns(active);
    if (offer_single(active, offer) || !crossed_.any()) return;
    sheet_.find(crossed_, [&](const ClosedSheet::Bits& choice) {
      float farthest = kNoDepth;
      for (std::size_t i = 0; i < columns_.size(); ++i)
        if (choice.test(static_cast<int>(i)))
          farthest = std::max(farthest, active[columns_[i]].depth);
      offer(farthest);
    });
  }

 private:
  // Of an edge, in the last search it was met in.
  struct EdgeUse {
    std::uint32_t search = 0;
    std::uint32_t count = 0, first = 0;  // triangles that might be chosen
    int row = -1;                        // of the sheet's
  };

  static std::uint32_t root(std::span<Active> active, std::uint32_t at);
  void join_pairs(std::span<Active> active);
  void make_columns(std::span<Active> active);

  // Parts that nothing else has a say in; the others are left in crossed_.
  template <class Offer>
  bool offer_single(std::span<Active> active, Offer&& offer) {
    bool found = false;
    crossed_ = {};
    for (std::uint32_t i = 0; i < active.size(); ++i) {
      const Active& part = active[i];
      if (part.parent != i || part.spoiled || !part.odd) continue;
      if (part.column >= 0) {
        crossed_.flip(part.column);
        continue;
      }
      offer(part.depth);
      found = true;
    }
    return found;
  }

  const SurfaceChain* chain_ = nullptr;
  std::uint32_t search_ = 0;
  std::vector<EdgeUse> use_of_;
  ClosedSheet sheet_;
  ClosedSheet::Bits crossed_;
  std::vector<std::uint32_t> columns_;  // of the sheet, by the root of their part
};

}  // namespace pvsfarm

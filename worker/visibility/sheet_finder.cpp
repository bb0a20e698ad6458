#include "worker/visibility/sheet_finder.hpp"

#include <algorithm>

namespace pvsfarm {

void SheetFinder::begin(const SurfaceChain& chain) {
  chain_ = &chain;
  search_ = 0;
  use_of_.assign(chain.edges.size(), {});
}

// Of the part; paths are halved on the way.
std::uint32_t SheetFinder::root(std::span<Active> active, std::uint32_t at) {
  while (active[at].parent != at) at = active[at].parent = active[active[at].parent].parent;
  return at;
}

// One with an edge that no other has cannot be chosen.
void SheetFinder::join_pairs(std::span<Active> active) {
  const auto for_each_use = [&](auto&& fn) {
    for (std::uint32_t i = 0; i < active.size(); ++i) {
      if (active[i].cut) continue;
      for (const std::uint32_t e : chain_->triangles[active[i].triangle].edge)
        if (met(e)) fn(i, use_of_[e]);
    }
  };
  for_each_use([](std::uint32_t i, EdgeUse& use) {
    if (use.count++ == 0) use.first = i;
  });
  for_each_use([&](std::uint32_t i, const EdgeUse& use) {
    if (use.count == 1) active[i].spoiled = true;
    if (use.count != 2) return;
    const std::uint32_t a = root(active, i), b = root(active, use.first);
    active[std::max(a, b)].parent = std::min(a, b);
  });
  for (std::uint32_t i = 0; i < active.size(); ++i)
    if (active[i].cut || active[i].spoiled) active[root(active, i)].spoiled = true;
}

// Gives a column to each part with edges of three triangles or more, and those edges to the sheet.
void SheetFinder::make_columns(std::span<Active> active) {
  columns_.clear();
  sheet_.begin();
  for (std::uint32_t i = 0; i < active.size(); ++i) {
    const std::uint32_t at = root(active, i);
    Active& part = active[at];
    for (const std::uint32_t e : chain_->triangles[active[i].triangle].edge) {
      EdgeUse& use = use_of_[e];
      if (part.spoiled || !met(e) || use.count < 3) continue;
      if (part.column < 0) {
        part.spoiled = columns_.size() == ClosedSheet::kMostColumns;  // left out
        if (part.spoiled) continue;
        part.column = static_cast<int>(columns_.size());
        columns_.push_back(at);
      }
      if (use.row < 0) use.row = sheet_.add_edge();
      sheet_.add_to_edge(use.row, part.column);
    }
  }
}

}  // namespace pvsfarm

// T-junctions: where a vertex lies exactly on somebody else's edge, the triangles of that edge are
// divided there, so that neighbours share whole edges.
#pragma once

#include "common/scene/surface_weld.hpp"

namespace pvsfarm {

// An edge and one of its triangles.
struct EdgeUse {
  std::uint64_t edge;  // vertices, the lower one in the high half
  std::uint32_t sheet;

  std::uint32_t low() const { return static_cast<std::uint32_t>(edge >> 32); }
  std::uint32_t high() const { return static_cast<std::uint32_t>(edge); }
};

inline std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return a < b ? std::uint64_t{a} << 32 | b : std::uint64_t{b} << 32 | a;
}

// Three for each sheet, by edge, then by sheet.
std::vector<EdgeUse> sorted_edge_uses(const std::vector<Sheet>& sheets);

// fn(first, last) for each group of uses of one edge.
template <class Fn>
void for_each_edge(const std::vector<EdgeUse>& uses, Fn&& fn) {
  for (std::size_t i = 0, end; i < uses.size(); i = end) {
    end = i + 1;
    while (end < uses.size() && uses[end].edge == uses[i].edge) ++end;
    fn(i, end);
  }
}

// Edges with an odd number of triangles, ascending, and the vertices at the ends of edges.
std::vector<std::uint64_t> open_edges(const std::vector<EdgeUse>& uses);
std::vector<std::uint32_t> ends_of_edges(const std::vector<std::uint64_t>& edges);

// The same matter, divided. Vertices that end no edge with an odd number of triangles divide
// nothing: where they lie, nothing is open.
// [limit] kMaxSplitRounds, as a division may lay a new edge across another vertex; and of a round
// kMaxSplitsPerTriangle on average, beyond which edges stay whole: that is always safe.
void split_edges_at_vertices(SheetMesh& mesh);
inline constexpr int kMaxSplitRounds = 4;
inline constexpr std::size_t kMaxSplitsPerTriangle = 16;

}  // namespace pvsfarm

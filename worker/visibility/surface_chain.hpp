// The triangles of the scene's surfaces that may block what one cell sees, with what bounds them.
//
// Source: docs/algorithm.md A.14. Whether a segment that leaves the cell crosses some of them an
// even or an odd number of times does not change while neither its end nor their border is met.
// Any part of the triangles is as good as all of them: leaving one out only adds border.
#pragma once

#include <cstdint>
#include <vector>

#include "common/cells/cell.hpp"
#include "common/scene/scene.hpp"
#include "worker/visibility/cell_frame.hpp"

namespace pvsfarm {

// Blocks whatever leaves the cell and meets it: the cell is before it, or it blocks from both sides
// and no eye is on it.
struct ChainTriangle {
  std::uint32_t vertex[3];
  std::uint32_t edge[3];  // into SurfaceChain::edges
  bool one_sided = false;
  bool for_all = true;  // of the cell; else it may block for eyes in a part of it
};

struct ChainEdge {
  std::uint32_t vertex[2];
};

// At or below the lowest occludee, and no eye inside the cell is: no line to an occludee comes
// there but at its end. Of aligned cells, by exact comparison.
inline constexpr std::uint8_t kBelowGround = 1u << 6;

struct SurfaceChain {
  std::vector<Vec3> vertices;  // local frame
  // Which faces of the cell a vertex lies beyond, see beyond_faces(); and kBelowGround.
  std::vector<std::uint8_t> beyond;
  std::vector<ChainTriangle> triangles;
  std::vector<ChainEdge> edges;
  void clear() {
    vertices.clear();
    beyond.clear();
    triangles.clear();
    edges.clear();
  }
};

struct ChainRequest {
  double near_m = 0;                      // matter nearer to the cell than this is left out
  std::size_t most_triangles = 1u << 17;  // the components that look largest, up to so many
  bool parts = false;                     // with what may block for eyes in a part of the cell only
};

// Threads: one object, one thread. Keeps scratch memory from cell to cell.
class SurfaceChainBuilder {
 public:
  explicit SurfaceChainBuilder(const Scene& scene);
  void build(const Cell& cell, const CellFrame& frame, const ChainRequest& request,
             SurfaceChain& chain);

 private:
  void choose_components(const CellFrame& frame, std::size_t most_triangles);
  void add_component(const SurfaceComponent& component, const Cell& cell, const CellFrame& frame,
                     const ChainRequest& request, SurfaceChain& chain);
  bool below_ground(const Vec3& world, const Cell& cell) const;
  std::uint32_t chain_vertex(std::uint32_t vertex, const Cell& cell, const CellFrame& frame,
                             SurfaceChain& chain);
  std::uint32_t chain_edge(std::uint32_t edge, const Cell& cell, const CellFrame& frame,
                           SurfaceChain& chain);

  const Scene& scene_;
  std::vector<std::uint32_t> vertex_of_, edge_of_;  // of the scene's, where it is in the chain
  std::vector<std::uint32_t> used_vertices_, used_edges_;
  std::vector<std::uint32_t> components_;
};

}  // namespace pvsfarm

#include "worker/visibility/surface_chain.hpp"

#include <algorithm>
#include <limits>

#include "worker/visibility/cell_clearance.hpp"

namespace pvsfarm {
namespace {

constexpr std::uint32_t kAbsent = std::numeric_limits<std::uint32_t>::max();

}  // namespace

SurfaceChainBuilder::SurfaceChainBuilder(const Scene& scene) : scene_(scene) {}

// Those that look largest from the cell, if not all fit.
void SurfaceChainBuilder::choose_components(const CellFrame& frame, std::size_t most_triangles) {
  const auto all = scene_.surface_components();
  components_.resize(all.size());
  for (std::uint32_t i = 0; i < all.size(); ++i) components_[i] = i;
  if (scene_.surface_triangles().size() <= most_triangles) return;
  const Box cell = frame.world_bounds();
  std::vector<double> apparent(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    double squared = 0;
    for (int a = 0; a < 3; ++a) {
      const double gap =
          std::max({0.0, all[i].box.lo[a] - cell.hi[a], cell.lo[a] - all[i].box.hi[a]});
      squared += gap * gap;
    }
    apparent[i] = all[i].area / std::max(squared, dot(frame.half(), frame.half()));
  }
  std::sort(components_.begin(), components_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return apparent[a] > apparent[b] || (apparent[a] == apparent[b] && a < b);
  });
  std::size_t total = 0;
  std::erase_if(components_, [&](std::uint32_t i) {
    if (total + all[i].triangle_count > most_triangles) return true;
    total += all[i].triangle_count;
    return false;
  });
}

bool SurfaceChainBuilder::below_ground(const Vec3& world, const Cell& cell) const {
  const double ground = scene_.ground();
  return has_world_coordinates(cell) && world.z <= ground &&
         (cell.lo.z > ground || (cell.lo.z == ground && cell.lo.z < cell.hi.z));
}

std::uint32_t SurfaceChainBuilder::chain_vertex(std::uint32_t vertex, const Cell& cell,
                                                const CellFrame& frame, SurfaceChain& chain) {
  std::uint32_t& at = vertex_of_[vertex];
  if (at != kAbsent) return at;
  at = static_cast<std::uint32_t>(chain.vertices.size());
  used_vertices_.push_back(vertex);
  const Vec3& world = scene_.surface_vertices()[vertex];
  const Vec3 local = frame.local_from_world(world);
  chain.vertices.push_back(local);
  chain.beyond.push_back(static_cast<std::uint8_t>(beyond_faces(world, local, cell, frame) |
                                                   (below_ground(world, cell) ? kBelowGround : 0)));
  return at;
}

std::uint32_t SurfaceChainBuilder::chain_edge(std::uint32_t edge, const Cell& cell,
                                              const CellFrame& frame, SurfaceChain& chain) {
  if (edge_of_[edge] != kAbsent) return edge_of_[edge];
  used_edges_.push_back(edge);
  const SurfaceEdge& source = scene_.surface_edges()[edge];
  const std::uint32_t a = chain_vertex(source.vertex[0], cell, frame, chain);
  const std::uint32_t b = chain_vertex(source.vertex[1], cell, frame, chain);
  edge_of_[edge] = static_cast<std::uint32_t>(chain.edges.size());
  chain.edges.push_back({{a, b}});
  return edge_of_[edge];
}

void SurfaceChainBuilder::add_component(const SurfaceComponent& component, const Cell& cell,
                                        const CellFrame& frame, const ChainRequest& request,
                                        SurfaceChain& chain) {
  const auto all = scene_.surface_triangles();
  const auto triangles = all.subspan(component.first_triangle, component.triangle_count);
  for (const SurfaceTriangle& triangle : triangles) {
    CornersAtCell corners;
    unsigned beyond = ~0u;
    for (int k = 0; k < 3; ++k) {
      corners.world[k] = scene_.surface_vertices()[triangle.vertex[k]];
      corners.local[k] = frame.local_from_world(corners.world[k]);
      beyond &= beyond_faces(corners.world[k], corners.local[k], cell, frame);
    }
    const int side = side_of_cell(corners, cell, frame);
    // No eye is on it: either its plane keeps off the inside of the cell, or that of a face does.
    const bool blocks = triangle.one_sided != 0 ? side > 0 : side != 0 || beyond != 0;
    const bool may_block = blocks || (request.parts && (triangle.one_sided == 0 || side == 0));
    if (!may_block || near_cell(corners, frame, request.near_m)) continue;
    ChainTriangle added{.one_sided = triangle.one_sided != 0, .for_all = blocks};
    for (int k = 0; k < 3; ++k) {
      const std::int32_t use = triangle.edge[k];
      const auto edge = static_cast<std::uint32_t>(use >= 0 ? use : ~use);
      added.vertex[k] = chain_vertex(triangle.vertex[k], cell, frame, chain);
      added.edge[k] = chain_edge(edge, cell, frame, chain);
    }
    chain.triangles.push_back(added);
  }
}

void SurfaceChainBuilder::build(const Cell& cell, const CellFrame& frame,
                                const ChainRequest& request, SurfaceChain& chain) {
  chain.clear();
  vertex_of_.resize(scene_.surface_vertices().size(), kAbsent);
  edge_of_.resize(scene_.surface_edges().size(), kAbsent);
  choose_components(frame, request.most_triangles);
  for (const std::uint32_t i : components_)
    add_component(scene_.surface_components()[i], cell, frame, request, chain);
  for (const std::uint32_t vertex : used_vertices_) vertex_of_[vertex] = kAbsent;
  for (const std::uint32_t edge : used_edges_) edge_of_[edge] = kAbsent;
  used_vertices_.clear();
  used_edges_.clear();
}

}  // namespace pvsfarm

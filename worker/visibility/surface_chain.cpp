#include "worker/visibility/surface_chain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pvsfarm {
namespace {

constexpr std::uint32_t kAbsent = std::numeric_limits<std::uint32_t>::max();
constexpr double kRounding = 0x1p-44;  // relative; dominates three dozen operations

double size_of(const Vec3& p) { return std::abs(p.x) + std::abs(p.y) + std::abs(p.z); }

// Whether coordinates of the world are those of the cell, bit for bit.
bool comparable(const Cell& cell, const CellFrame& frame) {
  return frame.aligned() && cell.origin == Vec3(0);
}

std::uint8_t beyond_faces(const Vec3& world, const Vec3& local, const Cell& cell,
                          const CellFrame& frame) {
  unsigned bits = 0;
  const double margin = kRounding * (size_of(local) + frame.offset_scale());
  for (int a = 0; a < 3; ++a) {
    const bool exact = comparable(cell, frame);
    const bool below = exact ? world[a] <= cell.lo[a] : local[a] + frame.half()[a] < -margin;
    const bool above = exact ? world[a] >= cell.hi[a] : local[a] - frame.half()[a] > margin;
    bits |= (below ? 1u : 0u) << (2 * a) | (above ? 1u : 0u) << (2 * a + 1);
  }
  return static_cast<std::uint8_t>(bits);
}

// On which side of the triangle's plane the inside of the cell lies: +1 in front, -1 behind, 0 on
// both, or doubt. The cell may touch the plane only where that is certain without rounding: along a
// face of an aligned cell that has some depth there.
int side_of_cell(const Vec3 (&world)[3], const Vec3 (&local)[3], const Cell& cell,
                 const CellFrame& frame) {
  const Vec3 ab = local[1] - local[0], ac = local[2] - local[0], n = cross(ab, ac);
  const Vec3& half = frame.half();
  const double around = size_of(local[0]) + frame.offset_scale() + size_of(half);
  const double normal_error =
      kRounding * (around + size_of(ab) + size_of(ac)) * (size_of(ab) + size_of(ac));
  const double ahead = -dot(n, local[0]);  // of the cell's centre
  const double reach = std::abs(n.x) * half.x + std::abs(n.y) * half.y + std::abs(n.z) * half.z;
  const double error = normal_error * around;
  if (ahead - reach > error) return 1;
  if (-ahead - reach > error) return -1;
  if (!comparable(cell, frame)) return 0;
  for (int a = 0; a < 3; ++a) {
    const double at = world[0][a];
    if (at != world[1][a] || at != world[2][a] || !(cell.lo[a] < cell.hi[a])) continue;
    if (!(std::abs(n[a]) > normal_error)) return 0;
    if (at <= cell.lo[a]) return n[a] > 0 ? 1 : -1;
    if (at >= cell.hi[a]) return n[a] > 0 ? -1 : 1;
  }
  return 0;
}

// Whether the triangle may come nearer to the cell than near_m.
bool near_cell(const Vec3 (&local)[3], const CellFrame& frame, double near_m) {
  if (!(near_m > 0)) return false;
  Box box;
  for (const Vec3& p : local) box.add(p);
  const double margin = kRounding * (size_of(box.lo) + size_of(box.hi) + frame.offset_scale());
  for (int a = 0; a < 3; ++a)
    if (box.lo[a] - frame.half()[a] > near_m + margin ||
        -frame.half()[a] - box.hi[a] > near_m + margin)
      return false;
  return true;
}

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

std::uint32_t SurfaceChainBuilder::chain_vertex(std::uint32_t vertex, const Cell& cell,
                                                const CellFrame& frame, SurfaceChain& chain) {
  std::uint32_t& at = vertex_of_[vertex];
  if (at != kAbsent) return at;
  at = static_cast<std::uint32_t>(chain.vertices.size());
  used_vertices_.push_back(vertex);
  const Vec3& world = scene_.surface_vertices()[vertex];
  const Vec3 local = frame.local_from_world(world);
  chain.vertices.push_back(local);
  chain.beyond.push_back(beyond_faces(world, local, cell, frame));
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
                                        const CellFrame& frame, double near_m,
                                        SurfaceChain& chain) {
  const auto all = scene_.surface_triangles();
  const auto triangles = all.subspan(component.first_triangle, component.triangle_count);
  for (const SurfaceTriangle& triangle : triangles) {
    Vec3 world[3], local[3];
    unsigned beyond = ~0u;
    for (int k = 0; k < 3; ++k) {
      world[k] = scene_.surface_vertices()[triangle.vertex[k]];
      local[k] = frame.local_from_world(world[k]);
      beyond &= beyond_faces(world[k], local[k], cell, frame);
    }
    const int side = side_of_cell(world, local, cell, frame);
    // No eye is on it: either its plane keeps off the inside of the cell, or that of a face does.
    const bool blocks = triangle.one_sided != 0 ? side > 0 : side != 0 || beyond != 0;
    if (!blocks || near_cell(local, frame, near_m)) continue;
    ChainTriangle added;
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
    add_component(scene_.surface_components()[i], cell, frame, request.near_m, chain);
  for (const std::uint32_t vertex : used_vertices_) vertex_of_[vertex] = kAbsent;
  for (const std::uint32_t edge : used_edges_) edge_of_[edge] = kAbsent;
  used_vertices_.clear();
  used_edges_.clear();
}

}  // namespace pvsfarm

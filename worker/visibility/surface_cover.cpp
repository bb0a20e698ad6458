#include "worker/visibility/surface_cover.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/geometry/rounding.hpp"
#include "worker/visibility/occludee_test.hpp"
#include "worker/visibility/segment_crossing.hpp"

namespace pvsfarm {
namespace {

// Where in a square its ray goes, and from where in the cell. Scenes and maps are symmetric: odd
// places are seldom on an edge.
constexpr double kSampleX = 0.4377, kSampleY = 0.5613;
constexpr double kEyeX = 0.137, kEyeY = -0.211, kEyeZ = 0.173;  // in half extents

unsigned beyond_on_plane(unsigned beyond, const ProjectionPlane& plane) {
  return ((beyond >> (2 * plane.face.u())) & 3) | ((beyond >> (2 * plane.face.v())) & 3) << 2;
}

}  // namespace

void SurfaceCover::prepare(const SurfaceChain& chain, const CellFrame& frame,
                           const ProjectionPlane& plane) {
  chain_ = &chain;
  squares_ = 0;
  const double hu = plane.hu, hv = plane.hv, hw = plane.hw;
  eye_ = {kEyeX * hu, kEyeY * hv, -plane.distance - hw + kEyeZ * hw};
  double largest = 0;
  vertices_.resize(chain.vertices.size());
  for (std::size_t i = 0; i < vertices_.size(); ++i) {
    const Vec3 p = vertices_[i] = plane.plane_from_local(chain.vertices[i]);
    largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  }
  scale_ = frame.offset_scale() + largest + hu + hv + 2 * hw + plane.distance;
  const ShadowMaker maker(plane, frame.offset_scale(), largest);
  edge_stack_.clear();
  triangle_stack_.clear();
  prepare_edges(chain, plane, maker);
  prepare_triangles(chain, maker);
}

void SurfaceCover::prepare_edges(const SurfaceChain& chain, const ProjectionPlane& plane,
                                 const ShadowMaker& maker) {
  const Vec2 middle{(plane.x0 + plane.x1()) / 2, (plane.y0 + plane.y1()) / 2};
  const Vec2 half{plane.x1() - middle.x, plane.y1() - middle.y};
  edge_shadows_.resize(chain.edges.size());
  finder_.begin(chain);
  for (std::uint32_t e = 0; e < chain.edges.size(); ++e) {
    const ChainEdge& edge = chain.edges[e];
    const unsigned beyond = chain.beyond[edge.vertex[0]] & chain.beyond[edge.vertex[1]];
    edge_shadows_[e] = maker.of_edge(vertices_[edge.vertex[0]], vertices_[edge.vertex[1]],
                                     beyond_on_plane(beyond, plane));
    // A little more than the map, so that no rounding of a square's middle matters.
    if (edge_shadows_[e].empty() ||
        !edge_shadows_[e].meets(middle.x, middle.y, half.x * 1.001, half.y * 1.001))
      continue;
    edge_stack_.push_back(e);
  }
}

void SurfaceCover::prepare_triangles(const SurfaceChain& chain, const ShadowMaker& maker) {
  const double tolerance = maker.depth_tolerance();
  section_shadows_.clear();
  section_of_.assign(chain.triangles.size(), -1);
  depth_of_.resize(chain.triangles.size());
  for (std::uint32_t t = 0; t < chain.triangles.size(); ++t) {
    const auto& v = chain.triangles[t].vertex;
    const Vec3 corners[3] = {vertices_[v[0]], vertices_[v[1]], vertices_[v[2]]};
    const auto [low, high] = std::minmax({corners[0].z, corners[1].z, corners[2].z});
    if (!(low <= tolerance)) continue;  // beyond the plane: no segment to it meets the triangle
    if (high >= -tolerance) {
      section_of_[t] = static_cast<std::int32_t>(section_shadows_.size());
      section_shadows_.push_back(maker.of_section(corners));
    }
    depth_of_[t] = high + tolerance < 0 ? float_not_below(high + tolerance) : 0.0f;
    triangle_stack_.push_back({.triangle = t});
  }
}

std::optional<bool> SurfaceCover::crossing(std::uint32_t triangle, const Vec3& sample) const {
  const auto& v = chain_->triangles[triangle].vertex;
  return crosses_triangle(eye_, sample, {vertices_[v[0]], vertices_[v[1]], vertices_[v[2]]},
                          scale_);
}

// Pushes the triangles of `triangles` that may be met in the square other than in their inside. One
// whose inside is met and nothing else covers all of the square: true.
bool SurfaceCover::collect(const Vec2& middle, const Vec2& half, Range triangles,
                           const Vec3& sample, float& depth) {
  const std::size_t first = triangle_stack_.size();
  for (std::size_t i = triangles.first; i < triangles.end; ++i) {
    const std::uint32_t t = triangle_stack_[i].triangle;
    const bool section = section_of_[t] >= 0 &&
                         section_shadows_[section_of_[t]].meets(middle.x, middle.y, half.x, half.y);
    bool active = section;
    for (const std::uint32_t e : chain_->triangles[t].edge) active = active || finder_.met(e);
    if (active) {
      const auto own = static_cast<std::uint32_t>(triangle_stack_.size() - first);
      triangle_stack_.push_back({.triangle = t, .parent = own, .cut = section});
    } else if (crossing(t, sample).value_or(false)) {
      depth = depth_of_[t];
      return true;
    }
  }
  return false;
}

bool SurfaceCover::some_sheet_covers(std::span<Active> active, const Vec3& sample, float& depth) {
  bool covers = false;
  finder_.find(
      active, [&](std::uint32_t i) { return crossing(active[i].triangle, sample); },
      [&](std::uint32_t i) { return depth_of_[active[i].triangle]; },
      [&](float z) {
        depth = covers ? std::min(depth, z) : z;
        covers = true;
      });
  return covers;
}

bool SurfaceCover::is_wanted(const Square& square) const {
  if (square.level < tile_level_) return true;  // as the square it is part of
  const int tiles = 1 << (square.level - tile_level_);
  for (int j = square.j * tiles; j < (square.j + 1) * tiles; ++j)
    for (int i = square.i * tiles; i < (square.i + 1) * tiles; ++i)
      if (wanted_->test(static_cast<std::size_t>(j) * kTilesPerSide + i)) return true;
  return false;
}

void SurfaceCover::visit(const Square& square, Range edges, Range triangles, OcclusionMap& map) {
  if (!is_wanted(square) || map.highest(square.level, square.i, square.j) <= 0) return;
  const ProjectionPlane& plane = map.plane();
  const double side = 1 << square.level;
  // Wide enough for the rounding of pixel borders.
  const Vec2 half{plane.px * side * (0.5 + 0x1p-30), plane.py * side * (0.5 + 0x1p-30)};
  const Vec2 middle{plane.x0 + plane.px * side * (square.i + 0.5),
                    plane.y0 + plane.py * side * (square.j + 0.5)};
  const Vec3 sample{middle.x + (2 * kSampleX - 1) * half.x, middle.y + (2 * kSampleY - 1) * half.y,
                    0};
  ++squares_;
  finder_.next();
  const std::size_t first_edge = edge_stack_.size(), first = triangle_stack_.size();
  for (std::size_t i = edges.first; i < edges.end; ++i) {
    const std::uint32_t e = edge_stack_[i];
    if (!edge_shadows_[e].meets(middle.x, middle.y, half.x, half.y)) continue;
    finder_.meet(e);
    edge_stack_.push_back(e);
  }
  float depth = 0;
  bool covered = collect(middle, half, triangles, sample, depth);
  if (!covered && triangle_stack_.size() > first) {
    covered = some_sheet_covers(std::span(triangle_stack_).subspan(first), sample, depth);
    if (!covered && square.level > 0) {
      const Range own_edges{first_edge, edge_stack_.size()};
      const Range own_triangles{first, triangle_stack_.size()};
      for (int k = 0; k < 4; ++k)
        visit({square.level - 1, 2 * square.i + (k & 1), 2 * square.j + (k >> 1)}, own_edges,
              own_triangles, map);
    }
  }
  if (covered) {
    const int pixels = 1 << square.level, row = plane.resolution_px;
    float* corner = map.base() + static_cast<std::size_t>(square.j) * pixels * row +
                    static_cast<std::size_t>(square.i) * pixels;
    for (int j = 0; j < pixels; ++j, corner += row)
      for (int i = 0; i < pixels; ++i) corner[i] = std::min(corner[i], depth);
  }
  edge_stack_.resize(first_edge);
  triangle_stack_.resize(first);
}

std::uint32_t SurfaceCover::draw(const SurfaceChain& chain, const CellFrame& frame,
                                 const TileMask& wanted, OcclusionMap& map) {
  squares_ = 0;
  if (wanted.none()) return 0;
  prepare(chain, frame, map.plane());
  const int level = std::bit_width(static_cast<unsigned>(map.plane().resolution_px)) - 1;
  wanted_ = &wanted;
  tile_level_ = std::max(level - std::countr_zero(static_cast<unsigned>(kTilesPerSide)), 0);
  const Range edges{0, edge_stack_.size()}, triangles{0, triangle_stack_.size()};
  visit({level, 0, 0}, edges, triangles, map);
  return squares_;
}

void add_wanted(const OcclusionMap& map, const Box& local_box, TileMask& wanted) {
  const ProjectionPlane& plane = map.plane();
  Box box = plane.plane_from_local(local_box);
  if (!(box.hi.z > 0)) return;
  // Of what begins beside or before the cell, the part well beyond the face.
  box.lo.z = std::max(box.lo.z, -plane.distance / 2);
  const PixelRange touched = map.touched(occludee_rect(plane, box));
  const int side = plane.resolution_px, tile = std::max(side / kTilesPerSide, 1);
  if (touched.i1 < 0 || touched.j1 < 0 || touched.i0 >= side || touched.j0 >= side) return;
  for (int j = std::max(touched.j0, 0) / tile; j <= std::min(touched.j1, side - 1) / tile; ++j)
    for (int i = std::max(touched.i0, 0) / tile; i <= std::min(touched.i1, side - 1) / tile; ++i)
      wanted.set(static_cast<std::size_t>(j) * kTilesPerSide + i);
}

}  // namespace pvsfarm

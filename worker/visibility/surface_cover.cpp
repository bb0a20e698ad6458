#include "worker/visibility/surface_cover.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/geometry/rounding.hpp"
#include "worker/visibility/occludee_test.hpp"

namespace pvsfarm {
namespace {

// Where in a square its ray goes, and from where in the cell. Scenes and maps are symmetric: odd
// places are seldom on an edge.
constexpr double kSampleX = 0.4377, kSampleY = 0.5613;
constexpr double kEyeX = 0.137, kEyeY = -0.211, kEyeZ = 0.173;  // in half extents

double size_of(const Vec3& p) { return std::abs(p.x) + std::abs(p.y) + std::abs(p.z); }

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
  use_of_.assign(chain.edges.size(), {});
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

// Whether the segment from the eye to the sample crosses the inside of the triangle. None: doubt.
std::optional<bool> SurfaceCover::crossing(std::uint32_t triangle, const Vec3& sample) const {
  const auto& v = chain_->triangles[triangle].vertex;
  const Vec3 a = vertices_[v[0]] - eye_, b = vertices_[v[1]] - eye_, c = vertices_[v[2]] - eye_;
  const Vec3 ray = sample - eye_;
  const Vec3 ab = cross(a, b), bc = cross(b, c), ca = cross(c, a);
  const double sa = size_of(a), sb = size_of(b), sc = size_of(c), rounding = 0x1p-44 * scale_;
  // Corners and eye are off by a part of `scale_`, and so each product of three by that times the
  // sizes of the two others.
  const double ray_size = size_of(ray) + scale_ * 0x1p-20;
  const double products[3] = {dot(ab, ray), dot(bc, ray), dot(ca, ray)};
  const double errors[3] = {rounding * ((sa + sb) * ray_size + sa * sb),
                            rounding * ((sb + sc) * ray_size + sb * sc),
                            rounding * ((sc + sa) * ray_size + sc * sa)};
  int left = 0, right = 0;
  for (int k = 0; k < 3; ++k) {
    left += products[k] > errors[k] ? 1 : 0;
    right += products[k] < -errors[k] ? 1 : 0;
  }
  if (left > 0 && right > 0) return false;
  if (left < 3 && right < 3) return {};
  // The line crosses the triangle. The segment does if eye and sample are on two sides of it.
  const double sign = left == 3 ? 1 : -1;
  const double ahead = sign * dot(a, bc);
  const double through = sign * (products[0] + products[1] + products[2]);
  const double most = std::max({sa, sb, sc});
  const double error = rounding * 8 * (most * most + most * ray_size);
  if (ahead < -error || through - ahead < -error) return false;
  if (ahead > error && through - ahead > error) return true;
  return {};
}

// Of the part; paths are halved on the way.
std::uint32_t SurfaceCover::root(std::span<Active> active, std::uint32_t at) {
  while (active[at].parent != at) at = active[at].parent = active[active[at].parent].parent;
  return at;
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
    for (const std::uint32_t e : chain_->triangles[t].edge)
      active = active || use_of_[e].square == squares_;
    if (active) {
      const auto own = static_cast<std::uint32_t>(triangle_stack_.size() - first);
      triangle_stack_.push_back({.triangle = t, .parent = own, .section = section});
    } else if (crossing(t, sample).value_or(false)) {
      depth = depth_of_[t];
      return true;
    }
  }
  return false;
}

// Joins triangles that share an edge that no third has: they are chosen together or not at all. One
// with an edge that no other has cannot be chosen, nor can one that is cut by the plane.
void SurfaceCover::join_pairs(std::span<Active> active) {
  const auto for_each_use = [&](auto&& fn) {
    for (std::uint32_t i = 0; i < active.size(); ++i) {
      if (active[i].section) continue;
      for (const std::uint32_t e : chain_->triangles[active[i].triangle].edge)
        if (use_of_[e].square == squares_) fn(i, use_of_[e]);
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
    if (active[i].section || active[i].spoiled) active[root(active, i)].spoiled = true;
}

// What the parts add to a choice: whether they are crossed an odd number of times, how deep they
// go. A part that may or may not be crossed cannot be chosen.
void SurfaceCover::count_crossings(std::span<Active> active, const Vec3& sample) {
  for (std::uint32_t i = 0; i < active.size(); ++i) {
    Active& part = active[root(active, i)];
    if (part.spoiled) continue;
    const std::optional<bool> crossed = crossing(active[i].triangle, sample);
    part.spoiled = !crossed;
    part.odd = part.odd != crossed.value_or(false);
    part.depth = std::max(part.depth, depth_of_[active[i].triangle]);
  }
}

// Gives a column to each part with edges of three triangles or more, and those edges to the sheet.
void SurfaceCover::make_columns(std::span<Active> active) {
  columns_.clear();
  sheet_.begin();
  for (std::uint32_t i = 0; i < active.size(); ++i) {
    const std::uint32_t at = root(active, i);
    Active& part = active[at];
    for (const std::uint32_t e : chain_->triangles[active[i].triangle].edge) {
      EdgeUse& use = use_of_[e];
      if (part.spoiled || use.square != squares_ || use.count < 3) continue;
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

bool SurfaceCover::some_sheet_covers(std::span<Active> active, const Vec3& sample, float& depth) {
  join_pairs(active);
  count_crossings(active, sample);
  make_columns(active);
  bool covers = false;
  const auto offer = [&](float z) {
    depth = covers ? std::min(depth, z) : z;
    covers = true;
  };
  // Parts that nothing else has a say in, then those that depend on each other.
  ClosedSheet::Bits crossed;
  for (std::uint32_t i = 0; i < active.size(); ++i) {
    const Active& part = active[i];
    if (part.parent != i || part.spoiled || !part.odd) continue;
    if (part.column < 0)
      offer(part.depth);
    else
      crossed.flip(part.column);
  }
  if (covers || !crossed.any()) return covers;
  sheet_.find(crossed, [&](const ClosedSheet::Bits& choice) {
    float farthest = -kUncovered;
    for (std::size_t i = 0; i < columns_.size(); ++i)
      if (choice.test(static_cast<int>(i)))
        farthest = std::max(farthest, active[columns_[i]].depth);
    offer(farthest);
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
  const std::size_t first_edge = edge_stack_.size(), first = triangle_stack_.size();
  for (std::size_t i = edges.first; i < edges.end; ++i) {
    const std::uint32_t e = edge_stack_[i];
    if (!edge_shadows_[e].meets(middle.x, middle.y, half.x, half.y)) continue;
    use_of_[e] = {.square = squares_};
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

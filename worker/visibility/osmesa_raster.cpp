#include "worker/visibility/osmesa_raster.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common/base/check.hpp"
#include "worker/render/min_depth_target.hpp"

namespace pvsfarm {
namespace {

// [pixels, times |nx| + |ny|] Half a pixel from centre to corner; 1/512 for the snapping of window
// coordinates to 1/256; 1/4096 for their rounding to float. No pixel too many in 500,000 polygons.
constexpr double kShrinkPx = 0.5 + 1.0 / 512 + 1.0 / 4096;
// Above this the sub-pixel grid is no longer what was measured: half a snapping step more.
constexpr int kFineUpToPx = 512;
constexpr double kCoarseShrinkPx = 0.5 + 1.0 / 256;

constexpr int kMaxVertices = 256;

struct Polygon {
  int size = 0;
  std::array<Vec2, kMaxVertices> vertex;
};

// Sutherland and Hodgman against n . p >= c. Returns whether anything is left.
bool clip(const Polygon& in, double nx, double ny, double c, Polygon& out) {
  out.size = 0;
  Vec2 from = in.vertex[in.size - 1];
  double from_value = nx * from.x + ny * from.y - c;
  for (int i = 0; i < in.size; ++i) {
    const Vec2 to = in.vertex[i];
    const double to_value = nx * to.x + ny * to.y - c;
    if ((from_value >= 0) != (to_value >= 0))
      out.vertex[out.size++] = from + (to - from) * (from_value / (from_value - to_value));
    if (to_value >= 0) out.vertex[out.size++] = to;
    if (out.size + 2 > kMaxVertices) return false;  // left out: always safe
    from = to;
    from_value = to_value;
  }
  return out.size >= 3;
}

bool all_inside(const Polygon& polygon, double nx, double ny, double c) {
  for (int i = 0; i < polygon.size; ++i)
    if (!(nx * polygon.vertex[i].x + ny * polygon.vertex[i].y >= c)) return false;
  return true;
}

}  // namespace

struct OsmesaRaster::State {
  explicit State(int side) : target(side) {}
  MinDepthTarget target;
  std::vector<WindowVertex> triangles;
  Polygon polygons[2];  // clipped from one to the other and back

  void add(const CoverageList& list, const Coverage& coverage, const ProjectionPlane& plane);
};

// The coverage's polygon in window pixels, shrunk, as a fan of triangles.
void OsmesaRaster::State::add(const CoverageList& list, const Coverage& c,
                              const ProjectionPlane& plane) {
  const double shrink = plane.resolution_px <= kFineUpToPx ? kShrinkPx : kCoarseShrinkPx;
  // A side on the map's border has been cut there, and its pixels are whole: no shrink.
  const double side = plane.resolution_px;
  const double x0 = c.x0 <= plane.x0 ? -1 : (c.x0 - plane.x0) / plane.px + shrink;
  const double x1 = c.x1 >= plane.x1() ? side + 1 : (c.x1 - plane.x0) / plane.px - shrink;
  const double y0 = c.y0 <= plane.y0 ? -1 : (c.y0 - plane.y0) / plane.py + shrink;
  const double y1 = c.y1 >= plane.y1() ? side + 1 : (c.y1 - plane.y0) / plane.py - shrink;
  if (!(x0 < x1) || !(y0 < y1)) return;
  Polygon *polygon = &polygons[0], *clipped = &polygons[1];
  polygon->size = 4;
  polygon->vertex[0] = {x0, y0};
  polygon->vertex[1] = {x1, y0};
  polygon->vertex[2] = {x1, y1};
  polygon->vertex[3] = {x0, y1};
  for (std::uint32_t h = 0; h < c.half_plane_count; ++h) {
    const HalfPlane& half_plane = list.half_planes[c.first_half_plane + h];
    const double nx = half_plane.nx * plane.px, ny = half_plane.ny * plane.py;
    const double at = half_plane.c - half_plane.nx * plane.x0 - half_plane.ny * plane.y0 +
                      shrink * (std::abs(nx) + std::abs(ny));
    if (all_inside(*polygon, nx, ny, at)) continue;
    if (!clip(*polygon, nx, ny, at, *clipped)) return;
    std::swap(polygon, clipped);
  }
  const auto vertex = [&](int i) {
    return WindowVertex{static_cast<float>(polygon->vertex[i].x),
                        static_cast<float>(polygon->vertex[i].y), c.depth};
  };
  for (int i = 1; i + 1 < polygon->size; ++i)
    triangles.insert(triangles.end(), {vertex(0), vertex(i), vertex(i + 1)});
}

OsmesaRaster::OsmesaRaster(int resolution_px) : state_(std::make_unique<State>(resolution_px)) {}
OsmesaRaster::~OsmesaRaster() = default;

void OsmesaRaster::draw(const CoverageList& list, OcclusionMap& map) {
  State& s = *state_;
  s.triangles.clear();
  for (const Coverage& coverage : list.coverages) s.add(list, coverage, map.plane());
  if (s.triangles.empty()) return;
  const std::span<const float> drawn = s.target.draw(s.triangles);
  rows_written_ += drawn.size() / kTilePx;
  float* const base = map.base();
  for (std::size_t i = 0; i < drawn.size(); ++i) base[i] = std::min(base[i], drawn[i]);
}

}  // namespace pvsfarm

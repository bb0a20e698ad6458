#include "worker/inquiry/certificate.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "common/geometry/rounding.hpp"
#include "worker/visibility/occludee_test.hpp"

namespace pvsfarm {
namespace {

bool overlap(const Coverage& c, const PlaneRect& rect) {
  return c.x0 <= rect.x1 && rect.x0 <= c.x1 && c.y0 <= rect.y1 && rect.y0 <= c.y1;
}

// How many pixels of an endless map the rectangle touches, counted as OcclusionMap counts.
double pixel_count(const ProjectionPlane& plane, const PlaneRect& rect) {
  const auto side = [](double lo, double hi, double per_px) {
    return std::floor(hi * per_px) - std::floor(lo * per_px) + 1;
  };
  return side(rect.x0 - plane.x0, rect.x1 - plane.x0, 1 / plane.px) *
         side(rect.y0 - plane.y0, rect.y1 - plane.y0, 1 / plane.py);
}

std::size_t count(const std::vector<std::uint64_t>& bits) {
  return std::accumulate(bits.begin(), bits.end(), std::size_t{0},
                         [](std::size_t n, std::uint64_t w) { return n + std::popcount(w); });
}

}  // namespace

Box world_around_local(const Cell& cell, const Box& local_box) {
  const Vec3 middle = cell.lo * 0.5 + cell.hi * 0.5;
  Box world;
  for (int k = 0; k < 8; ++k) world.add(cell.point(middle + local_box.corner(k)));
  return world;
}

Certificate::Certificate(const Scene& scene, const Cell& cell, const LocalOccluders& occluders,
                         double near_m)
    : scene_(scene),
      cell_(right_handed(cell)),
      occluders_(occluders),
      near_m_(near_m),
      frame_(cell) {}

std::vector<std::uint64_t> Certificate::covered_pixels(const PixelRange& range, float depth) const {
  const int side = map_.plane().resolution_px;
  const std::size_t width = range.i1 - range.i0 + 1, height = range.j1 - range.j0 + 1;
  std::vector<std::uint64_t> bits((width * height + 63) / 64);
  std::size_t at = 0;
  for (int j = range.j0; j <= range.j1; ++j)
    for (int i = range.i0; i <= range.i1; ++i, ++at)
      if (map_.base()[static_cast<std::size_t>(j) * side + i] < depth)
        bits[at >> 6] |= std::uint64_t{1} << (at & 63);
  return bits;
}

std::vector<Certificate::Layer> Certificate::layers(const ProjectionPlane& plane,
                                                    const PlaneRect& rect, float depth) {
  if (occluders_.list.empty()) return {};
  const int last = plane.resolution_px - 1;
  map_.reset(plane);
  PixelRange range = map_.touched(rect);
  range = {std::max(range.i0, 0), std::max(range.j0, 0), std::min(range.i1, last),
           std::min(range.j1, last)};
  std::vector<Layer> out;
  if (range.i0 > range.i1 || range.j0 > range.j1) return out;
  CoverageList coverages;
  std::array<Piece, 2> pieces;
  for (const LocalOccluder& occluder : occluders_.list) {
    coverages.clear();
    const int pieces_made = make_pieces(occluders_, occluder, plane, near_m_, pieces);
    for (int p = 0; p < pieces_made; ++p)
      project(pieces[p], plane, frame_.offset_scale(), coverages);
    std::erase_if(coverages.coverages,
                  [&](const Coverage& c) { return !(c.depth < depth) || !overlap(c, rect); });
    if (coverages.coverages.empty()) continue;
    for (int j = range.j0; j <= range.j1; ++j) {
      float* row = map_.base() + static_cast<std::size_t>(j) * plane.resolution_px;
      std::fill(row + range.i0, row + range.i1 + 1, kUncovered);
    }
    raster_.draw(coverages, map_);
    Layer layer{occluder.source, covered_pixels(range, depth)};
    if (count(layer.pixels) > 0) out.push_back(std::move(layer));
  }
  return out;
}

void Certificate::pick_blockers(std::vector<Layer> layers, ExplainFinding::Part& part) const {
  double covered = 0;
  while (!layers.empty()) {
    const auto best = std::max_element(
        layers.begin(), layers.end(),
        [](const Layer& a, const Layer& b) { return count(a.pixels) < count(b.pixels); });
    const auto added = static_cast<double>(count(best->pixels));
    covered += added;
    if (part.blockers.size() < kMaxBlockers) {
      const auto owners = scene_.owners(*best->source);
      part.blockers.push_back({{owners.begin(), owners.end()}, added / part.pixels});
    }
    const std::vector<std::uint64_t> gone = std::move(best->pixels);
    layers.erase(best);
    for (Layer& layer : layers)
      for (std::size_t w = 0; w < gone.size(); ++w) layer.pixels[w] &= ~gone[w];
    std::erase_if(layers, [](const Layer& layer) { return count(layer.pixels) == 0; });
  }
  part.covered = covered / part.pixels;
}

PlanePlace Certificate::place_of(const ProjectionPlane& plane, const PlaneRect& rect) const {
  const Face face = plane.face;
  Vec3 foot(0);
  foot[face.axis] = face.sign * (plane.hw + plane.distance);
  return {.origin = cell_.point(cell_.lo * 0.5 + cell_.hi * 0.5 + foot),
          .u = cell_.axes[face.u()],
          .v = cell_.axes[face.v()],
          .away = cell_.axes[face.axis] * static_cast<double>(face.sign),
          .x0 = rect.x0,
          .y0 = rect.y0,
          .x1 = rect.x1,
          .y1 = rect.y1,
          .distance_m = plane.distance,
          .resolution_px = plane.resolution_px};
}

// The numbers are those of test_box (occludee_test.cpp).
std::optional<ExplainFinding::Part> Certificate::redraw(const ProjectionPlane& plane,
                                                        const Box& local_box,
                                                        const std::optional<PlaneRect>& improved) {
  const Box box = plane.plane_from_local(local_box);
  const double rounding =
      0x1p-48 * (std::abs(box.lo.z) + std::abs(box.hi.z) + plane.distance + 2 * plane.hw);
  if (!(box.lo.z + plane.distance > rounding)) return std::nullopt;
  const PlaneRect rect = improved.value_or(occludee_rect(plane, box));
  ExplainFinding::Part part{.box = world_around_local(cell_, local_box),
                            .plane = place_of(plane, rect),
                            .depth_m = box.lo.z,
                            .pixels = pixel_count(plane, rect)};
  if (!std::isfinite(part.pixels)) return std::nullopt;
  pick_blockers(layers(plane, rect, float_not_above(box.lo.z - rounding)), part);
  return part;
}

}  // namespace pvsfarm

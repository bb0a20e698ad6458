#include "worker/visibility/direct_raster.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "worker/visibility/dispatch.hpp"

namespace pvsfarm {

// The scratch of a coverage: a row a place, rows before and after it to the border of a tile empty.
struct DirectRaster::Spans {
  alignas(64) double left[kMaxResolutionPx];
  alignas(64) double right[kMaxResolutionPx];
  alignas(64) int first[kMaxResolutionPx];
  alignas(64) int end[kMaxResolutionPx];
  std::uint8_t lowered[(kMaxResolutionPx / kTilePx) * (kMaxResolutionPx / kTilePx)] = {};
};

namespace {

// bound[j] = max(bound[j], offset + slope * (y + j * step)), or min.
PVSFARM_DISPATCH
void raise(double* bound, int n, double offset, double slope, double y, double step) {
  for (int j = 0; j < n; ++j) {
    const double at = offset + slope * (y + j * step);
    bound[j] = at > bound[j] ? at : bound[j];
  }
}
PVSFARM_DISPATCH
void lower(double* bound, int n, double offset, double slope, double y, double step) {
  for (int j = 0; j < n; ++j) {
    const double at = offset + slope * (y + j * step);
    bound[j] = at < bound[j] ? at : bound[j];
  }
}

// The pixels wholly inside [left, right], as [first, end): whole_pixels of occlusion_map.hpp, for n
// rows.
PVSFARM_DISPATCH
void whole_spans(const double* left, const double* right, int n, double from, double per_px,
                 double side, int* first, int* end) {
  for (int j = 0; j < n; ++j) {
    double a = (left[j] - from) * per_px - 0x1p-36, b = (right[j] - from) * per_px + 0x1p-36;
    a = a > 0 ? a : 0;
    a = a < side ? a : side;
    b = b > 0 ? b : 0;
    b = b < side ? b : side;
    const int i = static_cast<int>(a);
    first[j] = i + (static_cast<double>(i) < a ? 1 : 0);
    end[j] = static_cast<int>(b);
  }
}

// A map being drawn, tile by tile.
struct Canvas {
  float* pixels;
  float* tiles;
  std::uint8_t* lowered;  // a tile each: its bound was lowered, its pixels were not
  std::uint8_t* changed;  // a tile each, as the map has it
  int side;
  // kTilePx, as far as the compiler knows some multiple: loops of a fixed length are unrolled
  // before they could be vectorised.
  int tile_px;
  int width() const { return tile_px & -kTilePx; }
};

// Depth into the spans [first[j], end[j]) of a row of tiles, j its kTilePx rows, of which those
// before `from_row` and from `to_row` on are empty. Tiles that hold nothing farther are left alone;
// of those covered all over only the bound is lowered. Returns how many rows of tiles were written.
PVSFARM_DISPATCH
int fill(const Canvas& canvas, int tile_row, const int* first, const int* end, int from_row,
         int to_row, float depth) {
  const int width = canvas.width();
  int least = canvas.side, most = 0, full_from = 0, full_to = canvas.side;
  for (int j = 0; j < width; ++j) {
    least = first[j] < least ? first[j] : least;
    most = end[j] > most ? end[j] : most;
    full_from = first[j] > full_from ? first[j] : full_from;
    full_to = end[j] < full_to ? end[j] : full_to;
  }
  const std::ptrdiff_t row_of_tiles = std::ptrdiff_t{tile_row} * (canvas.side >> kTileLevel);
  float* const corner = canvas.pixels + std::ptrdiff_t{tile_row} * kTilePx * canvas.side;
  int written = 0;
  for (int tile = least >> kTileLevel; tile << kTileLevel < most; ++tile) {
    float& bound = canvas.tiles[row_of_tiles + tile];
    if (bound <= depth) continue;
    const int from = tile << kTileLevel;
    if (full_from <= from && full_to >= from + kTilePx) {
      bound = depth;
      canvas.lowered[row_of_tiles + tile] = 1;
      continue;
    }
    written += to_row - from_row;
    canvas.changed[row_of_tiles + tile] = OcclusionMap::kChanged;
    float* row = corner + from + std::ptrdiff_t{from_row} * canvas.side;
    for (int j = from_row; j < to_row; ++j, row += canvas.side) {
      const int a = first[j] - from, b = end[j] - from;
      for (int i = 0; i < width; ++i) {
        const float drawn = (i >= a) & (i < b) ? depth : kUncovered;
        row[i] = drawn < row[i] ? drawn : row[i];
      }
    }
  }
  return written;
}

// The bounds that were lowered into the pixels of their tiles. Returns how many rows were written.
PVSFARM_DISPATCH
int settle(const Canvas& canvas) {
  const int tiles = canvas.side >> kTileLevel, width = canvas.width();
  int written = 0;
  for (int k = 0; k < tiles * tiles; ++k) {
    if (canvas.lowered[k] == 0) continue;
    canvas.lowered[k] = 0;
    canvas.changed[k] = OcclusionMap::kChanged;
    written += kTilePx;
    const float depth = canvas.tiles[k];
    float* row = canvas.pixels + std::ptrdiff_t{k / tiles} * kTilePx * canvas.side +
                 std::ptrdiff_t{k % tiles} * kTilePx;
    for (int j = 0; j < kTilePx; ++j, row += canvas.side)
      for (int i = 0; i < width; ++i) row[i] = depth < row[i] ? depth : row[i];
  }
  return written;
}

// Rows of a coverage: `n` of them, the first one's lower edge at y.
struct Rows {
  double y, step;
  int n;
};

// Narrows the spans to the pixels wholly inside the half-plane.
void cut(const HalfPlane& h, const Coverage& c, const Rows& rows, double* left, double* right) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double worst_y = h.ny > 0 ? rows.y : rows.y + rows.step;  // of row 0
  const double y_reach = std::max(std::abs(rows.y), std::abs(rows.y + rows.n * rows.step));
  const double width = c.x1 - c.x0;
  // An edge along the rows: decided for the whole width at its worst x, no division by nx.
  if (std::abs(h.nx) * width <= 1e-6 * std::abs(h.ny) * rows.step) {
    const double worst_x = std::min(h.nx * c.x0, h.nx * c.x1);
    const double slack = 0x1p-48 * (std::abs(worst_x) + std::abs(h.ny) * y_reach + std::abs(h.c));
    for (int j = 0; j < rows.n; ++j)
      if (!(h.ny * (worst_y + j * rows.step) + worst_x >= h.c + slack)) left[j] = kInfinity;
    return;
  }
  const double slope = -h.ny / h.nx, offset = h.c / h.nx;
  const double slack = 0x1p-48 * (std::abs(offset) + std::abs(slope) * y_reach);
  // Monotone from row to row, so the first and the last say whether it cuts any.
  const double bound = h.nx > 0 ? offset + slack : offset - slack;
  const double at_first = bound + slope * worst_y;
  const double at_last = bound + slope * (worst_y + (rows.n - 1) * rows.step);
  if (h.nx > 0) {
    if (at_first <= c.x0 && at_last <= c.x0) return;
    raise(left, rows.n, bound, slope, worst_y, rows.step);
  } else {
    if (at_first >= c.x1 && at_last >= c.x1) return;
    lower(right, rows.n, bound, slope, worst_y, rows.step);
  }
}

}  // namespace

DirectRaster::DirectRaster() : spans_(std::make_unique<Spans>()) {}
DirectRaster::~DirectRaster() = default;

void DirectRaster::draw(const CoverageList& list, OcclusionMap& map) {
  const ProjectionPlane& plane = map.plane();
  const int side = plane.resolution_px;
  const double per_px = 1 / plane.px;
  Spans& spans = *spans_;
  const Canvas canvas{map.base_of_tiles(),
                      map.tiles().data(),
                      spans.lowered,
                      map.changed_tiles().data(),
                      side,
                      tile_px_};
  for (const Coverage& c : list.coverages) {
    const PixelRange inner = whole_pixels({c.x0, c.y0, c.x1, c.y1}, plane);
    if (inner.i0 > inner.i1 || inner.j0 > inner.j1) continue;
    const Rows rows{plane.y0 + inner.j0 * plane.py, plane.py, inner.j1 - inner.j0 + 1};
    std::fill(spans.left, spans.left + rows.n, c.x0);
    std::fill(spans.right, spans.right + rows.n, c.x1);
    for (std::uint32_t h = 0; h < c.half_plane_count; ++h)
      cut(list.half_planes[c.first_half_plane + h], c, rows, spans.left, spans.right);
    // Rows of the first and the last tile that the coverage does not reach: empty spans.
    const int first_row = inner.j0 & -kTilePx, end_row = (inner.j1 | (kTilePx - 1)) + 1;
    const auto clear_rows = [&](int from, int to) {
      std::fill(spans.first + from, spans.first + to, side);
      std::fill(spans.end + from, spans.end + to, 0);
    };
    clear_rows(first_row, inner.j0);
    clear_rows(inner.j1 + 1, end_row);
    whole_spans(spans.left, spans.right, rows.n, plane.x0, per_px, side, spans.first + inner.j0,
                spans.end + inner.j0);
    for (int j = first_row; j < end_row; j += kTilePx)
      rows_written_ +=
          fill(canvas, j >> kTileLevel, spans.first + j, spans.end + j, std::max(inner.j0 - j, 0),
               std::min(inner.j1 + 1 - j, kTilePx), c.depth);
  }
  rows_written_ += settle(canvas);
}

}  // namespace pvsfarm

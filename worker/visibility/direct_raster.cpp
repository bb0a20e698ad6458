#include "worker/visibility/direct_raster.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "worker/visibility/dispatch.hpp"

namespace pvsfarm {

struct DirectRaster::Spans {
  alignas(64) double left[kMaxResolutionPx];
  alignas(64) double right[kMaxResolutionPx];
  alignas(64) int first[kMaxResolutionPx];
  alignas(64) int end[kMaxResolutionPx];
};

namespace {

constexpr int kBlockPx = 16;  // divides every resolution

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

// Depth into the spans of n rows.
PVSFARM_DISPATCH
void fill(float* rows, int side, const int* first, const int* end, int n, float depth) {
  for (int j = 0; j < n; ++j, rows += side) {
    const int from = first[j], to = end[j];
    if (from >= to) continue;
    // Whole blocks, so that no lane is left for a loop of its own: most spans are short.
    const int start = from & -kBlockPx, pixels = ((to - start) + kBlockPx - 1) & -kBlockPx;
    float* const row = rows + start;
    for (int i = 0; i < pixels; ++i) {
      const float drawn = (i >= from - start) & (i < to - start) ? depth : kUncovered;
      row[i] = drawn < row[i] ? drawn : row[i];
    }
  }
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
  for (const Coverage& c : list.coverages) {
    const PixelRange inner = whole_pixels({c.x0, c.y0, c.x1, c.y1}, plane);
    if (inner.i0 > inner.i1 || inner.j0 > inner.j1) continue;
    const Rows rows{plane.y0 + inner.j0 * plane.py, plane.py, inner.j1 - inner.j0 + 1};
    std::fill(spans.left, spans.left + rows.n, c.x0);
    std::fill(spans.right, spans.right + rows.n, c.x1);
    for (std::uint32_t h = 0; h < c.half_plane_count; ++h)
      cut(list.half_planes[c.first_half_plane + h], c, rows, spans.left, spans.right);
    whole_spans(spans.left, spans.right, rows.n, plane.x0, per_px, side, spans.first, spans.end);
    fill(map.base() + static_cast<std::size_t>(inner.j0) * side, side, spans.first, spans.end,
         rows.n, c.depth);
  }
}

}  // namespace pvsfarm

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

// The pixels wholly inside [left, right], as [first, end): coordinates become pixels, the left end
// rounds up, the right end down. The slack keeps rounding (2^-43 pixel) from losing pixels at the
// map's own border; every other bound has a margin of at least 10^-9 pixel (projection.cpp: 10^-6
// of the smaller side, and sides differ by 256 at most).
PVSFARM_DISPATCH
void whole_pixels(const double* left, const double* right, int n, double from, double per_px,
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
  for (int j = 0; j < n; ++j, rows += side)
    for (int i = first[j]; i < end[j]; ++i) rows[i] = depth < rows[i] ? depth : rows[i];
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
  if (h.nx > 0) {
    raise(left, rows.n, offset + slack, slope, worst_y, rows.step);
  } else {
    lower(right, rows.n, offset - slack, slope, worst_y, rows.step);
  }
}

}  // namespace

DirectRaster::DirectRaster() : spans_(std::make_unique<Spans>()) {}
DirectRaster::~DirectRaster() = default;

void DirectRaster::draw(const CoverageList& list, OcclusionMap& map) {
  const ProjectionPlane& plane = map.plane();
  const int side = plane.resolution_px;
  const double per_px = 1 / plane.px, per_py = 1 / plane.py;
  Spans& spans = *spans_;
  for (const Coverage& c : list.coverages) {
    int j0 = 0, j1 = 0;
    whole_pixels(&c.y0, &c.y1, 1, plane.y0, per_py, side, &j0, &j1);
    if (j0 >= j1) continue;
    const Rows rows{plane.y0 + j0 * plane.py, plane.py, j1 - j0};
    std::fill(spans.left, spans.left + rows.n, c.x0);
    std::fill(spans.right, spans.right + rows.n, c.x1);
    for (std::uint32_t h = 0; h < c.half_plane_count; ++h)
      cut(list.half_planes[c.first_half_plane + h], c, rows, spans.left, spans.right);
    whole_pixels(spans.left, spans.right, rows.n, plane.x0, per_px, side, spans.first, spans.end);
    fill(map.base() + static_cast<std::size_t>(j0) * side, side, spans.first, spans.end, rows.n,
         c.depth);
  }
}

}  // namespace pvsfarm

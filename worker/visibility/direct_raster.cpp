#include "worker/visibility/direct_raster.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "worker/visibility/dispatch.hpp"

namespace pvsfarm {

struct DirectRaster::Spans {
  alignas(64) double left[kMaxResolutionPx];
  alignas(64) double right[kMaxResolutionPx];
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

PVSFARM_DISPATCH
void fill(float* row, int n, float depth) {
  for (int i = 0; i < n; ++i) row[i] = depth < row[i] ? depth : row[i];
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
  float* const base = map.base();
  double *const left = spans_->left, *const right = spans_->right;
  for (const Coverage& c : list.coverages) {
    // Pixel edges are plane.x0 + i px up to rounding, which the margin in every bound dominates.
    const int j0 = std::max(0, static_cast<int>(std::ceil((c.y0 - plane.y0) / plane.py)));
    const int j1 = std::min(side, static_cast<int>(std::floor((c.y1 - plane.y0) / plane.py)));
    if (j0 >= j1) continue;
    const Rows rows{plane.y0 + j0 * plane.py, plane.py, j1 - j0};
    std::fill(left, left + rows.n, c.x0);
    std::fill(right, right + rows.n, c.x1);
    for (std::uint32_t h = 0; h < c.half_plane_count; ++h)
      cut(list.half_planes[c.first_half_plane + h], c, rows, left, right);
    for (int j = 0; j < rows.n; ++j) {
      if (!(right[j] - left[j] >= plane.px)) continue;
      const int i0 = std::max(0, static_cast<int>(std::ceil((left[j] - plane.x0) / plane.px)));
      const int i1 = std::min(side, static_cast<int>(std::floor((right[j] - plane.x0) / plane.px)));
      if (i0 < i1) fill(base + static_cast<std::size_t>(j0 + j) * side + i0, i1 - i0, c.depth);
    }
  }
}

}  // namespace pvsfarm

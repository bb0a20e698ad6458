#include "worker/visibility/reprojection.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/base/check.hpp"
#include "common/geometry/rounding.hpp"
#include "worker/visibility/dispatch.hpp"

namespace pvsfarm {
namespace {

// out[i] = max(out[i], other[i])
PVSFARM_DISPATCH
void raise(float* out, const float* other, int n) {
  for (int i = 0; i < n; ++i) out[i] = other[i] > out[i] ? other[i] : out[i];
}

// The widest window that is a power of two and fits into every valid span; 0: there is none.
int common_window(std::span<const PixelSpan> spans) {
  std::int32_t least = 0;
  for (const PixelSpan& span : spans)
    if (span.valid() && (least == 0 || span.size() < least)) least = span.size();
  return least == 0 ? 0 : static_cast<int>(std::bit_floor(static_cast<unsigned>(least)));
}

// Calls visit(at) for windows [at, at + window) that together are exactly the span.
template <class Visit>
void for_each_window(const PixelSpan& span, int window, Visit&& visit) {
  const int end = span.last + 1 - window;
  for (int at = span.first; at < end; at += window) visit(at);
  visit(end);
}

// rows[j] = max of `window` rows from j on, by doubling.
void widen_rows(std::vector<float>& map, int side, int window) {
  for (int step = 1; step < window; step *= 2)
    for (int j = 0; j + step < side; ++j)
      raise(&map[static_cast<std::size_t>(j) * side],
            &map[static_cast<std::size_t>(j + step) * side], side);
}

}  // namespace

void footprints(const ProjectionPlane& from, const ProjectionPlane& to, MapAxis axis,
                std::vector<PixelSpan>& out) {
  PVS_CHECK(from.face.axis == to.face.axis && from.face.sign == to.face.sign);
  PVS_CHECK(from.hu == to.hu && from.hv == to.hv && from.hw == to.hw);
  PVS_CHECK_LE(from.distance, to.distance);
  const bool x = axis == MapAxis::kX;
  const double half = x ? to.hu : to.hv;
  const double to_0 = x ? to.x0 : to.y0, to_px = x ? to.px : to.py;
  const double from_0 = x ? from.x0 : from.y0, from_px = x ? from.px : from.py;
  const double per_px = 1 / from_px, side = from.resolution_px;
  // A ray from V to p crosses the nearer plane at V + (p - V) t. Extreme at the cell's four corners
  // of this axis and the line of sight, and at the pixel's ends.
  const double t_front = from.distance / to.distance;
  const double t_back = (from.distance + 2 * to.hw) / (to.distance + 2 * to.hw);
  const double reach_front = half * (1 - t_front), reach_back = half * (1 - t_back);
  out.resize(to.resolution_px);
  for (int i = 0; i < to.resolution_px; ++i) {
    const double p0 = to_0 + i * to_px, p1 = to_0 + (i + 1) * to_px;
    const double lo = std::min(p0 * t_front - reach_front, p0 * t_back - reach_back);
    const double hi = std::max(p1 * t_front + reach_front, p1 * t_back + reach_back);
    // The products above, the pixel's ends and the two divisions: a dozen roundings of numbers no
    // larger than these. 10^-9 pixel for the product below.
    const double wide = 0x1p-46 * (std::abs(p0) + std::abs(p1) + half);
    const double first = (lo - wide - from_0) * per_px - 1e-9;
    const double last = (hi + wide - from_0) * per_px + 1e-9;
    // Not in the map, or not a number.
    if (!(first >= 0 && last < side)) {
      out[i] = PixelSpan{};
      continue;
    }
    out[i] = {static_cast<std::int32_t>(first), static_cast<std::int32_t>(last)};
  }
}

// A sliding maximum, first over rows, then over columns.
void Reprojection::gather(const OcclusionMap& from, OcclusionMap& to) {
  footprints(from.plane(), to.plane(), MapAxis::kX, columns_);
  footprints(from.plane(), to.plane(), MapAxis::kY, rows_);
  const int column_window = common_window(columns_), row_window = common_window(rows_);
  if (column_window == 0 || row_window == 0) return;
  const int from_side = from.plane().resolution_px, to_side = to.plane().resolution_px;
  rising_.assign(from.base(), from.base() + static_cast<std::size_t>(from_side) * from_side);
  widen_rows(rising_, from_side, row_window);

  // Depth beyond the face stays; z counts from the plane. Uncovered stays uncovered.
  const double nearer = from.plane().distance - to.plane().distance;
  const double scale = from.plane().distance + to.plane().distance;
  row_.resize(from_side);
  for (int j = 0; j < to_side; ++j) {
    if (!rows_[j].valid()) continue;
    std::fill(row_.begin(), row_.end(), -kUncovered);
    for_each_window(rows_[j], row_window, [&](int at) {
      raise(row_.data(), &rising_[static_cast<std::size_t>(at) * from_side], from_side);
    });
    for (int step = 1; step < column_window; step *= 2)
      raise(row_.data(), row_.data() + step, from_side - step);
    float* out = to.base() + static_cast<std::size_t>(j) * to_side;
    for (int i = 0; i < to_side; ++i) {
      if (!columns_[i].valid()) continue;
      float deepest = -kUncovered;
      for_each_window(columns_[i], column_window,
                      [&](int at) { deepest = std::max(deepest, row_[at]); });
      if (deepest == kUncovered) continue;
      const double z = static_cast<double>(deepest) + nearer;
      const float depth = float_not_below(z + 0x1p-46 * (std::abs(z) + scale));
      out[i] = std::min(out[i], depth);
    }
  }
}

}  // namespace pvsfarm

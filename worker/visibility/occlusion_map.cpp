#include "worker/visibility/occlusion_map.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/base/check.hpp"
#include "worker/visibility/dispatch.hpp"

namespace pvsfarm {
namespace {

// A test begins this many levels below the one whose squares span its range: those reach beyond it,
// and hardly ever say yes.
constexpr int kFinerLevels = 3;

// Two rows of `source` (each 2n long) to one row of n: max or min of 2 x 2 texels.
PVSFARM_DISPATCH
void reduce_max(const float* row0, const float* row1, float* out, int n) {
  for (int i = 0; i < n; ++i) {
    const float a = row0[2 * i] > row0[2 * i + 1] ? row0[2 * i] : row0[2 * i + 1];
    const float b = row1[2 * i] > row1[2 * i + 1] ? row1[2 * i] : row1[2 * i + 1];
    out[i] = a > b ? a : b;
  }
}
PVSFARM_DISPATCH
void reduce_min(const float* row0, const float* row1, float* out, int n) {
  for (int i = 0; i < n; ++i) {
    const float a = row0[2 * i] < row0[2 * i + 1] ? row0[2 * i] : row0[2 * i + 1];
    const float b = row1[2 * i] < row1[2 * i + 1] ? row1[2 * i] : row1[2 * i + 1];
    out[i] = a < b ? a : b;
  }
}

}  // namespace

PixelRange whole_pixels(const PlaneRect& rect, const ProjectionPlane& plane) {
  const double side = plane.resolution_px, per_px = 1 / plane.px, per_py = 1 / plane.py;
  const auto on_map = [side](double pixels) { return std::clamp(pixels, 0.0, side); };
  const auto up = [&](double pixels) {
    pixels = on_map(pixels - 0x1p-36);
    const int whole = static_cast<int>(pixels);
    return whole + (static_cast<double>(whole) < pixels ? 1 : 0);
  };
  const auto down = [&](double pixels) { return static_cast<int>(on_map(pixels + 0x1p-36)); };
  return {up((rect.x0 - plane.x0) * per_px), up((rect.y0 - plane.y0) * per_py),
          down((rect.x1 - plane.x0) * per_px) - 1, down((rect.y1 - plane.y0) * per_py) - 1};
}

void OcclusionMap::reset(const ProjectionPlane& plane) {
  PVS_CHECK(std::has_single_bit(static_cast<unsigned>(plane.resolution_px)));
  PVS_CHECK_LE(plane.resolution_px, kMaxResolutionPx);
  plane_ = plane;
  per_px_ = 1 / plane.px;
  per_py_ = 1 / plane.py;
  built_ = false;
  level_count_ = std::bit_width(static_cast<unsigned>(plane.resolution_px));
  levels_max_.resize(level_count_);
  levels_min_.resize(level_count_ - 1);
  for (int k = 0; k < level_count_; ++k) {
    const std::size_t side = plane.resolution_px >> k;
    levels_max_[k].resize(side * side);
    if (k > 0) levels_min_[k - 1].resize(side * side);
  }
  std::fill(levels_max_[0].begin(), levels_max_[0].end(), kUncovered);
  const std::size_t tiles = plane.resolution_px >> kTileLevel;
  tiles_.assign(tiles * tiles, kUncovered);
}

void OcclusionMap::build_pyramids() {
  built_ = true;
  for (int k = 1; k < level_count_; ++k) {
    const int side = plane_.resolution_px >> k;
    const float* below_max = levels_max_[k - 1].data();
    const float* below_min = k == 1 ? below_max : levels_min_[k - 2].data();
    for (int j = 0; j < side; ++j) {
      const std::size_t row = std::size_t{2} * j * 2 * side;
      reduce_max(below_max + row, below_max + row + 2 * side, &levels_max_[k][j * side], side);
      reduce_min(below_min + row, below_min + row + 2 * side, &levels_min_[k - 1][j * side], side);
    }
  }
  if (!tiles_.empty())
    std::copy(levels_max_[kTileLevel].begin(), levels_max_[kTileLevel].end(), tiles_.begin());
}

// Rounding of the product is at most 2^-40 pixel; callers widen their rectangles by more.
// Requires numbers, not NaN.
PixelRange OcclusionMap::touched(const PlaneRect& rect) const {
  const double side = plane_.resolution_px;
  const auto pixel = [side](double pixels) {
    if (pixels < 0) return -1;
    return static_cast<int>(pixels < side ? pixels : side);
  };
  return {pixel((rect.x0 - plane_.x0) * per_px_), pixel((rect.y0 - plane_.y0) * per_py_),
          pixel((rect.x1 - plane_.x0) * per_px_), pixel((rect.y1 - plane_.y0) * per_py_)};
}

bool OcclusionMap::covered_in(int level, int i, int j, const PixelRange& range, float depth) const {
  const int side = plane_.resolution_px >> level;
  if (levels_max_[level][static_cast<std::size_t>(j) * side + i] < depth) return true;
  // A square within the range that has a farther pixel.
  if (i << level >= range.i0 && ((i + 1) << level) - 1 <= range.i1 && j << level >= range.j0 &&
      ((j + 1) << level) - 1 <= range.j1)
    return false;
  const int half = level - 1;
  // From above, where most of what shows does.
  for (int dj = 1; dj >= 0; --dj) {
    const int cj = 2 * j + dj;
    if (cj < (range.j0 >> half) || cj > (range.j1 >> half)) continue;
    for (int di = 0; di < 2; ++di) {
      const int ci = 2 * i + di;
      if (ci < (range.i0 >> half) || ci > (range.i1 >> half)) continue;
      if (!covered_in(half, ci, cj, range, depth)) return false;
    }
  }
  return true;
}

bool OcclusionMap::covered(const PlaneRect& rect, float depth) const {
  if (!(rect.x0 <= rect.x1 && rect.y0 <= rect.y1)) return false;  // NaN: doubt means visible
  return covered(touched(rect), depth);
}

bool OcclusionMap::covered(const PixelRange& r, float depth) const {
  const int last = plane_.resolution_px - 1;
  if (r.i0 < 0 || r.j0 < 0 || r.i1 > last || r.j1 > last) return false;
  const int span = std::max(r.i1 - r.i0, r.j1 - r.j0);
  const int level = std::max<int>(
      static_cast<int>(std::bit_width(static_cast<unsigned>(span))) - kFinerLevels, 0);
  for (int j = r.j1 >> level; j >= r.j0 >> level; --j)
    for (int i = r.i0 >> level; i <= r.i1 >> level; ++i)
      if (!covered_in(level, i, j, r, depth)) return false;
  return true;
}

bool OcclusionMap::needs_nothing(const PixelRange& r, float depth) const {
  const int tiles = plane_.resolution_px >> kTileLevel;
  const auto tiles_are = [&] {
    for (int j = r.j0 >> kTileLevel; j <= r.j1 >> kTileLevel; ++j)
      for (int i = r.i0 >> kTileLevel; i <= r.i1 >> kTileLevel; ++i)
        if (!(tiles_[static_cast<std::size_t>(j) * tiles + i] <= depth)) return false;
    return true;
  };
  return (tiles > 0 && tiles_are()) || (built_ && covered(r, depth));
}

float OcclusionMap::lower_bound(const PlaneRect& rect) const {
  if (!(rect.x0 <= rect.x1 && rect.y0 <= rect.y1)) return -kUncovered;
  return lower_bound(touched(rect));
}

float OcclusionMap::lower_bound(const PixelRange& range) const {
  PixelRange r = range;
  const int last = plane_.resolution_px - 1;
  if (r.i1 < 0 || r.j1 < 0 || r.i0 > last || r.j0 > last) return kUncovered;
  r = {std::max(r.i0, 0), std::max(r.j0, 0), std::min(r.i1, last), std::min(r.j1, last)};
  const int span = std::max(r.i1 - r.i0, r.j1 - r.j0);
  const int level = std::min<int>(std::bit_width(static_cast<unsigned>(span)), level_count_ - 1);
  const auto& texels = level == 0 ? levels_max_[0] : levels_min_[level - 1];
  const int side = plane_.resolution_px >> level;
  float lowest = kUncovered;
  for (int j = r.j0 >> level; j <= r.j1 >> level; ++j)
    for (int i = r.i0 >> level; i <= r.i1 >> level; ++i)
      lowest = std::min(lowest, texels[static_cast<std::size_t>(j) * side + i]);
  return lowest;
}

}  // namespace pvsfarm

#include "worker/visibility/occlusion_map.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/base/check.hpp"
#include "worker/visibility/dispatch.hpp"
#include "worker/visibility/lanes.hpp"

namespace pvsfarm {
namespace {

// A test begins this many levels below the one whose squares span its range: those reach beyond it,
// and hardly ever say yes.
constexpr int kFinerLevels = 3;

constexpr std::uint8_t kSinceReset = 1, kSinceBuild = 2;
static_assert(OcclusionMap::kChanged == (kSinceReset | kSinceBuild));

// The first levels of a map, up to texels of a tile each.
struct TileLevels {
  float* max[kTileLevel + 1];
  float* min;  // of the last one
  int side;    // of the map
};

// Columns [from, to) of a level's rows [first, end), from the level below: the maximum of 2 x 2
// texels.
PVSFARM_INLINE void reduce_max(const float* below, float* out, int side, int first, int end,
                               int from, int to) {
  for (int j = first; j < end; ++j) {
    const float *row0 = below + std::ptrdiff_t{4} * j * side,
                *row1 = row0 + std::ptrdiff_t{2} * side;
    float* to_row = out + std::ptrdiff_t{j} * side;
    for (int i = from; i < to; ++i) {
      const float a = row0[2 * i] > row0[2 * i + 1] ? row0[2 * i] : row0[2 * i + 1];
      const float b = row1[2 * i] > row1[2 * i + 1] ? row1[2 * i] : row1[2 * i + 1];
      to_row[i] = a > b ? a : b;
    }
  }
}

// The levels of tiles [from, to) of a row of them, from the pixels.
PVSFARM_DISPATCH
void reduce_tiles(const TileLevels& levels, int tile_row, int from, int to) {
  for (int k = 1; k <= kTileLevel; ++k) {
    const int px = kTilePx >> k;
    reduce_max(levels.max[k - 1], levels.max[k], levels.side >> k, tile_row * px,
               (tile_row + 1) * px, from * px, to * px);
  }
  alignas(64) float least[kMaxResolutionPx];
  const int n = (to - from) * kTilePx;
  const float* row = levels.max[0] + std::ptrdiff_t{tile_row} * kTilePx * levels.side +
                     std::ptrdiff_t{from} * kTilePx;
  for (int i = 0; i < n; ++i) least[i] = row[i];
  for (int j = 1; j < kTilePx; ++j) {
    row += levels.side;
    for (int i = 0; i < n; ++i) least[i] = row[i] < least[i] ? row[i] : least[i];
  }
  float* out = levels.min + std::ptrdiff_t{tile_row} * (levels.side >> kTileLevel);
  for (int t = from; t < to; ++t) {
    const float* own = least + (t - from) * kTilePx;
    float lowest = own[0];
    for (int i = 1; i < kTilePx; ++i) lowest = own[i] < lowest ? own[i] : lowest;
    out[t] = lowest;
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

void OcclusionMap::make_levels() {
  level_count_ = std::bit_width(static_cast<unsigned>(plane_.resolution_px));
  min_from_ = plane_.resolution_px < kTilePx ? level_count_ - 1 : kTileLevel;
  std::size_t size = 0;
  const auto place = [&](int k) {
    const std::size_t side = plane_.resolution_px >> k, at = size;
    size += side * side;
    return at;
  };
  for (int k = 0; k < level_count_; ++k) max_at_[k] = place(k);
  for (int k = min_from_; k < level_count_; ++k) min_at_[k] = place(k);
  texels_.resize(size);
  const std::size_t tiles = plane_.resolution_px >> kTileLevel;
  tiles_.resize(tiles * tiles);
  changed_.resize(tiles * tiles);
}

void OcclusionMap::empty_all() { std::fill(texels_.begin(), texels_.end(), kUncovered); }

// What no tile was changed in is empty already.
void OcclusionMap::empty_changed() {
  const int tiles = plane_.resolution_px >> kTileLevel;
  for (int t = 0; t < tiles * tiles; ++t) {
    if (changed_[t] == 0) continue;
    for (int k = 0; k < kTileLevel; ++k) {
      const std::ptrdiff_t side = plane_.resolution_px >> k, px = kTilePx >> k;
      float* row = max_level(k) + (t / tiles) * px * side + (t % tiles) * px;
      for (int j = 0; j < px; ++j, row += side) std::fill(row, row + px, kUncovered);
    }
  }
  const std::size_t from = tiles_.empty() ? 0 : max_at_[kTileLevel];
  std::fill(texels_.begin() + static_cast<std::ptrdiff_t>(from), texels_.end(), kUncovered);
}

void OcclusionMap::reset(const ProjectionPlane& plane) {
  PVS_CHECK(std::has_single_bit(static_cast<unsigned>(plane.resolution_px)));
  PVS_CHECK_LE(plane.resolution_px, kMaxResolutionPx);
  const bool same_size = level_count_ > 0 && plane.resolution_px == plane_.resolution_px;
  plane_ = plane;
  per_px_ = 1 / plane.px;
  per_py_ = 1 / plane.py;
  built_ = false;
  if (!same_size) make_levels();
  if (!same_size || all_changed_)
    empty_all();
  else
    empty_changed();
  std::fill(tiles_.begin(), tiles_.end(), kUncovered);
  std::fill(changed_.begin(), changed_.end(), 0);
  all_changed_ = false;
}

// Levels up to tiles, where something has changed since they were made last.
void OcclusionMap::reduce_changed() {
  TileLevels levels{.max = {}, .min = min_level(kTileLevel), .side = plane_.resolution_px};
  for (int k = 0; k <= kTileLevel; ++k) levels.max[k] = max_level(k);
  const int tiles = plane_.resolution_px >> kTileLevel;
  for (int j = 0; j < tiles; ++j) {
    std::uint8_t* row = &changed_[static_cast<std::size_t>(j) * tiles];
    const auto is_changed = [&](int i) { return all_changed_ || (row[i] & kSinceBuild) != 0; };
    for (int i = 0; i < tiles; ++i) {
      if (!is_changed(i)) continue;
      const int from = i;
      for (; i < tiles && is_changed(i); ++i) row[i] &= ~kSinceBuild;
      reduce_tiles(levels, j, from, i);
    }
  }
}

void OcclusionMap::build_pyramids() {
  built_ = true;
  if (!tiles_.empty())
    reduce_changed();
  else
    *min_level(min_from_) = *std::min_element(texels_.data(), texels_.data() + min_at_[min_from_]);
  for (int k = tiles_.empty() ? 1 : kTileLevel + 1; k < level_count_; ++k) {
    const int side = plane_.resolution_px >> k;
    reduce_max(max_level(k - 1), max_level(k), side, 0, side, 0, side);
  }
  for (int k = min_from_ + 1; k < level_count_; ++k) {
    const std::size_t side = plane_.resolution_px >> k;
    const float* below = min_level(k - 1);
    float* out = min_level(k);
    for (std::size_t t = 0; t < side * side; ++t) {
      const float* row = below + t / side * 4 * side + t % side * 2;
      out[t] = std::min({row[0], row[1], row[2 * side], row[2 * side + 1]});
    }
  }
  if (!tiles_.empty()) std::copy_n(max_level(kTileLevel), tiles_.size(), tiles_.begin());
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

// A square that has a pixel not nearer: whether all such pixels lie outside the range.
bool OcclusionMap::covered_within(int level, int i, int j, const PixelRange& range,
                                  float depth) const {
  if (i << level >= range.i0 && ((i + 1) << level) - 1 <= range.i1 && j << level >= range.j0 &&
      ((j + 1) << level) - 1 <= range.j1)
    return false;
  const int half = level - 1;
  const int i0 = std::max(2 * i, range.i0 >> half), i1 = std::min(2 * i + 1, range.i1 >> half);
  const int j0 = std::max(2 * j, range.j0 >> half), j1 = std::min(2 * j + 1, range.j1 >> half);
  // From above, where most of what shows does.
  for (int cj = j1; cj >= j0; --cj)
    for (int ci = i0; ci <= i1; ++ci)
      if (!(highest(half, ci, cj) < depth) && !covered_within(half, ci, cj, range, depth))
        return false;
  return true;
}

bool OcclusionMap::covered(const PlaneRect& rect, float depth) const {
  if (!(rect.x0 <= rect.x1 && rect.y0 <= rect.y1)) return false;  // NaN: doubt means visible
  return covered(touched(rect), depth);
}

bool OcclusionMap::covered(const PixelRange& r, float depth) const {
  const int last = plane_.resolution_px - 1;
  if (r.i0 < 0 || r.j0 < 0 || r.i1 > last || r.j1 > last) return false;
  // From above, where most of what shows does: pixel by pixel, and without a branch for each.
  const float* top = base() + (static_cast<std::size_t>(r.j1) << (level_count_ - 1));
  bool nearer = true;
  for (int i = r.i0; i <= r.i1; ++i) nearer = nearer & (top[i] < depth);
  if (!nearer) return false;
  const int span = std::max(r.i1 - r.i0, r.j1 - r.j0);
  const int level = std::max<int>(
      static_cast<int>(std::bit_width(static_cast<unsigned>(span))) - kFinerLevels, 0);
  for (int j = r.j1 >> level; j >= r.j0 >> level; --j)
    for (int i = r.i0 >> level; i <= r.i1 >> level; ++i)
      if (!(highest(level, i, j) < depth) && !covered_within(level, i, j, r, depth)) return false;
  return true;
}

bool OcclusionMap::tiles_need_nothing(const PixelRange& r, float depth) const {
  const int tiles = plane_.resolution_px >> kTileLevel;
  for (int j = r.j0 >> kTileLevel; j <= r.j1 >> kTileLevel; ++j)
    for (int i = r.i0 >> kTileLevel; i <= r.i1 >> kTileLevel; ++i)
      if (tiles == 0 || !(tiles_[static_cast<std::size_t>(j) * tiles + i] <= depth)) return false;
  return true;
}

bool OcclusionMap::needs_nothing(const PixelRange& r, float depth) const {
  return tiles_need_nothing(r, depth) || (built_ && covered(r, depth));
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
  const int level = std::clamp(static_cast<int>(std::bit_width(static_cast<unsigned>(span))),
                               min_from_, level_count_ - 1);
  // At most two texels a side.
  const float* texels = min_level(level);
  const int shift = level_count_ - 1 - level;
  const int i0 = r.i0 >> level, i1 = r.i1 >> level;
  const float *low = texels + ((r.j0 >> level) << shift),
              *high = texels + ((r.j1 >> level) << shift);
  return std::min(std::min(low[i0], low[i1]), std::min(high[i0], high[i1]));
}

}  // namespace pvsfarm

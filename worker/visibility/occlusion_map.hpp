// The occlusion map of one projection plane: a depth a pixel, with ray certificates.
//
// Source: Durand 2000, 2.3 and 2.4; theory 0.4, A.9. Pixel q holds Z(q): for every point p of the
// closed pixel and every V of the cell, the ray from V through p meets matter beyond the cell at
// depth <= Z. Depth is z of the plane frame (negative before the plane); kUncovered = none known.
// Differs from Durand 2000: the hidden test is for one plane at a time, strict, and never clips.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "worker/visibility/cell_frame.hpp"

namespace pvsfarm {

inline constexpr float kUncovered = std::numeric_limits<float>::infinity();
inline constexpr int kMaxResolutionPx = 1024;
inline constexpr int kTileLevel = 4, kTilePx = 1 << kTileLevel;  // divides every map that is drawn

// A rectangle on the plane, in the plane's coordinates.
struct PlaneRect {
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

// Pixels i0 .. i1 of rows j0 .. j1, both ends included.
struct PixelRange {
  int i0, j0, i1, j1;
};

// The pixels wholly inside `rect`, which lies in the plane's rectangle; i0 > i1 or j0 > j1: none.
// The slack keeps rounding (2^-43 pixel) from losing pixels at the plane's own border; every other
// bound of a coverage has a margin of at least 10^-9 pixel (projection.cpp: 10^-6 of the smaller
// side, and sides differ by 256 at most).
PixelRange whole_pixels(const PlaneRect& rect, const ProjectionPlane& plane);

class OcclusionMap {
 public:
  // Requires: resolution a power of two, at most kMaxResolutionPx.
  void reset(const ProjectionPlane& plane);

  const ProjectionPlane& plane() const { return plane_; }
  // Row j, pixel i: base()[j * resolution + i]. To be asked for anew after build_pyramids(), before
  // more is written.
  float* base() {
    all_changed_ = true;
    return texels_.data();
  }
  const float* base() const { return texels_.data(); }
  // Of each square of kTilePx pixels a side, row by row: at this depth and beyond nothing need be
  // drawn there, because all of it is nearer or nobody wants it. A hint to who draws, who lowers
  // it; no test reads it. build_pyramids() makes it the greatest Z. Empty below kTilePx.
  std::span<float> tiles() { return tiles_; }

  // The base for who marks the squares of tiles() it changes pixels of, by kChanged: the others
  // need not be reduced, nor emptied for the next plane.
  float* base_of_tiles() { return texels_.data(); }
  static constexpr std::uint8_t kChanged = 3;
  std::span<std::uint8_t> changed_tiles() { return changed_; }

  // To be called when the base has changed, before any test.
  void build_pyramids();
  // Whether every pixel that `rect` touches has Z < depth. False where rect leaves the map.
  bool covered(const PlaneRect& rect, float depth) const;
  bool covered(const PixelRange& range, float depth) const;
  // Whether nothing need be drawn in `range` at `depth`, as far as tiles() tell, and the pyramids
  // if they were built. May be asked while a map is drawn. Requires: `range` in the map.
  bool needs_nothing(const PixelRange& range, float depth) const;
  // The same, as far as tiles() alone tell.
  bool tiles_need_nothing(const PixelRange& range, float depth) const;
  // A lower bound of the smallest Z of any pixel that `rect` touches, read from at most 2 x 2
  // texels of the min pyramid, which are as large as tiles at least; kUncovered where rect misses
  // the map.
  float lower_bound(const PlaneRect& rect) const;
  float lower_bound(const PixelRange& range) const;
  // The greatest Z of a square of 2^level pixels a side, as the pyramids were built last.
  float highest(int level, int i, int j) const {
    return max_level(level)[(std::size_t(j) << (level_count_ - 1 - level)) + i];
  }
  float lowest() const { return min_level(level_count_ - 1)[0]; }
  // The pixels that `rect` touches; -1 or the resolution where it leaves the map.
  PixelRange touched(const PlaneRect& rect) const;

 private:
  // Row by row, of levels from the map itself up to one texel; the least Z from min_from_ on.
  float* max_level(int k) { return texels_.data() + max_at_[k]; }
  const float* max_level(int k) const { return texels_.data() + max_at_[k]; }
  float* min_level(int k) { return texels_.data() + min_at_[k]; }
  const float* min_level(int k) const { return texels_.data() + min_at_[k]; }
  bool covered_within(int level, int i, int j, const PixelRange& range, float depth) const;
  void make_levels();
  void empty_all();
  void empty_changed();
  void reduce_changed();

  ProjectionPlane plane_;
  double per_px_ = 1, per_py_ = 1;
  int level_count_ = 0;
  int min_from_ = 0;  // the first level with a least Z: tiles, or the whole map if it is smaller
  std::vector<float> texels_;  // of all levels
  static constexpr int kMostLevels = 11;
  static_assert(1 << (kMostLevels - 1) == kMaxResolutionPx);
  std::array<std::size_t, kMostLevels> max_at_{}, min_at_{};  // of a level, in texels_
  std::vector<float> tiles_;
  std::vector<std::uint8_t> changed_;  // by tile: since the reset, since the pyramids
  bool all_changed_ = false;
  bool built_ = false;  // the pyramids, since the last reset
};

}  // namespace pvsfarm

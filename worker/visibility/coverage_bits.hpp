// An occlusion map of one bit a pixel, for sweeps: a covered pixel holds a ray certificate of one
// depth that is the same for the whole map.
//
// Source: Durand 2000, 5.2; theory 0.4, B.1, B.4. A sweep tests an object against a plane before
// it, so how deep before that plane a ray is blocked does not matter: no depths, 32 times less
// memory, and a re-projection is a handful of shifts and ands a row.
// Differs from Durand 2000: covered does not mean "before the plane" but "no deeper than bound()",
// a little behind it. Occluders on both sides of a plane, where Projections lose least, count.
#pragma once

#include <cstdint>
#include <vector>

#include "worker/visibility/projection.hpp"
#include "worker/visibility/reprojection.hpp"

namespace pvsfarm {

// Where the bits lie. Words run along one axis of the plane, whose pixels are plane.resolution_px;
// rows along the other, and only so many as are of use: beyond them nothing is covered.
struct SweepPlane {
  ProjectionPlane plane;
  MapAxis along = MapAxis::kX;
  int row_count = 0;  // [limit] plane.resolution_px
  // No ray through a covered pixel gets deeper than this beyond the face.
  double bound = 0;
};

inline constexpr int kMaxSweepPx = 2048;

// Pixels of a map of bits: first .. last of both axes, ends included.
struct BitRange {
  int along_first = 0, along_last = -1, across_first = 0, across_last = -1;
  bool empty() const { return along_first > along_last || across_first > across_last; }
};

// The grid of a map of bits, along and across its words.
struct BitGrid {
  double a0 = 0, b0 = 0;          // the lower corner
  double pa = 1, pb = 1;          // a pixel
  double per_pa = 1, per_pb = 1;  // 1 / pa, 1 / pb
  int columns = 0, rows = 0;
  // The pixels wholly inside a rectangle that has a margin of 10^-6 pixel or is the map's own
  // border.
  BitRange whole(double a_lo, double a_hi, double b_lo, double b_hi) const;
};

// A bound of a convex shape's pixels, from row to row: at_first + j * step in row j of its rows.
struct RowLine {
  double at_first, step;
};

// A convex shape as rows of pixels: `count` of them from `first` on, each from the largest of the
// lefts to the smallest of the rights, pixels wholly between.
struct RowShape {
  static constexpr int kMaxLines = 8 * kMaxPiecePoints;  // an edge a point, eight views
  int first = 0, count = 0;
  double left = 0, right = 0;
  int left_count = 0, right_count = 0;
  RowLine lefts[kMaxLines], rights[kMaxLines];

  void begin(const BitRange& range, double a_lo, double a_hi);
  // Of lines that another one outdoes in the first row and in the last, few are left.
  void thin_out();
};

// Threads: one object, one thread. Allocates nothing once warm.
class CoverageBits {
 public:
  // Requires: resolution_px a multiple of 64, at most kMaxSweepPx.
  void reset(const SweepPlane& plane);
  const SweepPlane& where() const { return where_; }

  // Covers the pixels wholly inside the coverages that are no deeper than the bound.
  void draw(const CoverageList& list);
  // Covers what `from` certifies: the pixels whose whole footprint is covered there.
  // Requires: a plane of the same face and cell, not farther, along the same axis, its bound not
  // deeper.
  void gather(const CoverageBits& from);
  // Covers all rows wholly below `level`, a coordinate across the rows.
  void cover_below(double level);

  // Whether every pixel that `rect` touches is covered. False where rect leaves the map.
  bool covered(const PlaneRect& rect) const;
  // Whether nothing in `rect` can be covered anew: what of it lies in the map is covered already.
  bool settled(const PlaneRect& rect) const;
  std::uint64_t covered_pixels() const;
  bool covered_at(int along, int row) const {
    return (column(along / 64)[row] >> (along % 64)) & 1;
  }

  const BitGrid& grid() const { return grid_; }
  // Whether all pixels of the range, which lies in the map, are covered.
  bool all_covered(const BitRange& range) const;
  // Covers the shape, which says no more than a ray certificate no deeper than bound().
  void fill(const RowShape& shape);

 private:
  std::uint64_t* column(int word) { return &bits_[static_cast<std::size_t>(word) * stride_]; }
  const std::uint64_t* column(int word) const {
    return &bits_[static_cast<std::size_t>(word) * stride_];
  }
  BitRange touched(const PlaneRect& rect) const;
  void draw(const Coverage& c, const HalfPlane* half_planes);

  SweepPlane where_;
  BitGrid grid_;
  int words_ = 0;           // of a row
  std::size_t stride_ = 0;  // rows, and what fills the last eight
  // Word by word, and the rows one after another: eight rows are as many lanes.
  std::vector<std::uint64_t> bits_;
  // Kept from call to call.
  std::vector<PixelSpan> along_spans_, across_spans_;
  std::vector<std::uint64_t> fused_, picked_;
  RowShape shape_;
};

}  // namespace pvsfarm

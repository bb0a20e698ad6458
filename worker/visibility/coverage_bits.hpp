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
    return (row_bits(row)[along / 64] >> (along % 64)) & 1;
  }

 private:
  struct Range {
    int first, last;  // pixels; -1 or the count where the rectangle leaves the map
  };
  std::uint64_t* row_bits(int row) { return &bits_[static_cast<std::size_t>(row) * words_]; }
  const std::uint64_t* row_bits(int row) const {
    return &bits_[static_cast<std::size_t>(row) * words_];
  }
  void touched(const PlaneRect& rect, Range& along, Range& across) const;
  bool all_set(const Range& along, const Range& across) const;
  void draw(const Coverage& c, const HalfPlane* half_planes);

  SweepPlane where_;
  int columns_ = 0, rows_ = 0, words_ = 0;
  // The plane's coordinates along and across the words.
  double a0_ = 0, pa_ = 1, b0_ = 0, pb_ = 1, per_pa_ = 1, per_pb_ = 1;
  std::vector<std::uint64_t> bits_;
  // Kept from call to call.
  std::vector<PixelSpan> along_spans_, across_spans_;
  std::vector<std::uint64_t> window_;
  std::vector<double> left_, right_;
  std::vector<int> first_, end_;
};

}  // namespace pvsfarm

#include "worker/visibility/coverage_bits.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "common/base/check.hpp"
#include "worker/visibility/dispatch.hpp"

namespace pvsfarm {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Bits first .. last of a word, 0 <= first <= last < 64.
std::uint64_t bits_between(int first, int last) {
  return (~0ull >> (63 - last)) & (~0ull << first);
}

// Calls visit(word, mask) for the words that hold pixels first .. last.
template <class Visit>
void for_each_word(int first, int last, Visit&& visit) {
  const int end = last / 64;
  for (int w = first / 64; w <= end; ++w)
    visit(w, bits_between(w == first / 64 ? first % 64 : 0, w == end ? last % 64 : 63));
}

// bound[j] = max(bound[j], offset + slope * (at + j * step)), or min.
PVSFARM_DISPATCH
void raise(double* bound, int n, double offset, double slope, double at, double step) {
  for (int j = 0; j < n; ++j) {
    const double value = offset + slope * (at + j * step);
    bound[j] = value > bound[j] ? value : bound[j];
  }
}
PVSFARM_DISPATCH
void lower(double* bound, int n, double offset, double slope, double at, double step) {
  for (int j = 0; j < n; ++j) {
    const double value = offset + slope * (at + j * step);
    bound[j] = value < bound[j] ? value : bound[j];
  }
}

// The pixels wholly inside [left, right], as [first, end). Bounds have a margin of 10^-6 pixel or
// are the map's own border, which rounding must not move.
PVSFARM_DISPATCH
void whole_pixels(const double* left, const double* right, int n, double from, double per_px,
                  double count, int* first, int* end) {
  for (int j = 0; j < n; ++j) {
    double a = (left[j] - from) * per_px - 0x1p-36, b = (right[j] - from) * per_px + 0x1p-36;
    a = a > 0 ? a : 0;
    a = a < count ? a : count;
    b = b > 0 ? b : 0;
    b = b < count ? b : count;
    const int i = static_cast<int>(a);
    first[j] = i + (static_cast<double>(i) < a ? 1 : 0);
    end[j] = static_cast<int>(b);
  }
}

// 64 pixels from `first` on; beyond the row they are uncovered.
std::uint64_t bits_from(const std::uint64_t* row, int words, int first) {
  const int word = first >> 6, shift = first & 63;
  const std::uint64_t low = word >= 0 && word < words ? row[word] : 0;
  if (shift == 0) return low;
  const std::uint64_t high = word + 1 >= 0 && word + 1 < words ? row[word + 1] : 0;
  return (low >> shift) | (high << (64 - shift));
}

}  // namespace

void CoverageBits::reset(const SweepPlane& plane) {
  PVS_CHECK(plane.plane.resolution_px % 64 == 0);
  PVS_CHECK_LE(plane.plane.resolution_px, kMaxSweepPx);
  PVS_CHECK_LE(plane.row_count, plane.plane.resolution_px);
  where_ = plane;
  columns_ = plane.plane.resolution_px;
  rows_ = plane.row_count;
  words_ = columns_ / 64;
  const bool x = plane.along == MapAxis::kX;
  a0_ = x ? plane.plane.x0 : plane.plane.y0;
  pa_ = x ? plane.plane.px : plane.plane.py;
  b0_ = x ? plane.plane.y0 : plane.plane.x0;
  pb_ = x ? plane.plane.py : plane.plane.px;
  per_pa_ = 1 / pa_;
  per_pb_ = 1 / pb_;
  bits_.assign(static_cast<std::size_t>(rows_) * words_, 0);
  left_.resize(rows_);
  right_.resize(rows_);
  first_.resize(rows_);
  end_.resize(rows_);
}

// Rounding of the product is below 10^-9 pixel; callers widen their rectangles by more.
void CoverageBits::touched(const PlaneRect& rect, Range& along, Range& across) const {
  const auto pixel = [](double at, int count) {
    if (!(at >= 0)) return -1;
    return at < count ? static_cast<int>(at) : count;
  };
  const bool x = where_.along == MapAxis::kX;
  const double alo = x ? rect.x0 : rect.y0, ahi = x ? rect.x1 : rect.y1;
  const double blo = x ? rect.y0 : rect.x0, bhi = x ? rect.y1 : rect.x1;
  along = {pixel((alo - a0_) / pa_ - 1e-9, columns_), pixel((ahi - a0_) / pa_ + 1e-9, columns_)};
  across = {pixel((blo - b0_) / pb_ - 1e-9, rows_), pixel((bhi - b0_) / pb_ + 1e-9, rows_)};
}

bool CoverageBits::all_set(const Range& along, const Range& across) const {
  for (int j = across.first; j <= across.last; ++j) {
    const std::uint64_t* row = row_bits(j);
    std::uint64_t missing = 0;
    for_each_word(along.first, along.last,
                  [&](int w, std::uint64_t mask) { missing |= mask & ~row[w]; });
    if (missing != 0) return false;
  }
  return true;
}

bool CoverageBits::covered(const PlaneRect& rect) const {
  if (!(rect.x0 <= rect.x1 && rect.y0 <= rect.y1)) return false;  // NaN: doubt means visible
  Range along, across;
  touched(rect, along, across);
  if (along.first < 0 || across.first < 0 || along.last >= columns_ || across.last >= rows_)
    return false;
  return all_set(along, across);
}

bool CoverageBits::settled(const PlaneRect& rect) const {
  if (!(rect.x0 <= rect.x1 && rect.y0 <= rect.y1)) return false;
  Range along, across;
  touched(rect, along, across);
  along = {std::max(along.first, 0), std::min(along.last, columns_ - 1)};
  across = {std::max(across.first, 0), std::min(across.last, rows_ - 1)};
  if (along.first > along.last) return true;
  return all_set(along, across);
}

std::uint64_t CoverageBits::covered_pixels() const {
  std::uint64_t sum = 0;
  for (const std::uint64_t word : bits_) sum += std::popcount(word);
  return sum;
}

void CoverageBits::cover_below(double level) {
  for (int j = 0; j < rows_ && b0_ + (j + 1) * pb_ + 1e-9 * pb_ < level; ++j)
    std::fill_n(row_bits(j), words_, ~0ull);
}

void CoverageBits::gather(const CoverageBits& from) {
  PVS_CHECK(from.where_.along == where_.along);
  PVS_CHECK_LE(from.where_.bound, where_.bound);
  const MapAxis across = where_.along == MapAxis::kX ? MapAxis::kY : MapAxis::kX;
  footprints(from.where_.plane, where_.plane, where_.along, along_spans_);
  footprints(from.where_.plane, where_.plane, across, across_spans_);

  // Along a row the footprint of pixel i is i + [first, last], nearly the same for neighbours where
  // the grids are scaled alike: one shift for a word's 64, wide enough for all of them.
  struct Shift {
    int first = 0, last = -1;
    std::uint64_t valid = 0;
  };
  std::array<Shift, kMaxSweepPx / 64> shifts;
  int window = columns_;
  for (int w = 0; w < words_; ++w) {
    Shift& shift = shifts[w];
    for (int i = 64 * w; i < 64 * w + 64; ++i) {
      const PixelSpan& span = along_spans_[i];
      if (!span.valid()) continue;
      if (shift.valid == 0) shift = {span.first - i, span.last - i, 0};
      shift.first = std::min(shift.first, span.first - i);
      shift.last = std::max(shift.last, span.last - i);
      shift.valid |= 1ull << (i % 64);
    }
    if (shift.valid != 0) window = std::min(window, shift.last - shift.first + 1);
  }
  window = static_cast<int>(std::bit_floor(static_cast<unsigned>(window)));

  window_.resize(from.words_);
  for (int j = 0; j < rows_; ++j) {
    const PixelSpan& span = across_spans_[j];
    // Rows beyond those kept are uncovered.
    if (!span.valid() || span.last >= from.rows_) continue;
    std::copy_n(from.row_bits(span.first), from.words_, window_.data());
    for (int k = span.first + 1; k <= span.last; ++k) {
      const std::uint64_t* row = from.row_bits(k);
      for (int w = 0; w < from.words_; ++w) window_[w] &= row[w];
    }
    // Bit i: whether pixels i .. i + window - 1 are all covered.
    for (int step = 1; step < window; step *= 2)
      for (int w = 0; w < from.words_; ++w)
        window_[w] &= bits_from(window_.data(), from.words_, 64 * w + step);
    std::uint64_t* out = row_bits(j);
    for (int w = 0; w < words_; ++w) {
      const Shift& shift = shifts[w];
      if (shift.valid == 0) continue;
      const int end = shift.last + 1 - window;
      std::uint64_t word = bits_from(window_.data(), from.words_, 64 * w + end);
      for (int at = shift.first; at < end && word != 0; at += window)
        word &= bits_from(window_.data(), from.words_, 64 * w + at);
      out[w] |= word & shift.valid;
    }
  }
}

void CoverageBits::draw(const CoverageList& list) {
  const double deepest = where_.bound - where_.plane.distance;
  for (const Coverage& c : list.coverages)
    if (c.depth <= deepest) draw(c, list.half_planes.data() + c.first_half_plane);
}

// A row's span is the common part of all half-planes at the row's worst edge, as in DirectRaster.
void CoverageBits::draw(const Coverage& c, const HalfPlane* half_planes) {
  const bool x = where_.along == MapAxis::kX;
  const double alo = x ? c.x0 : c.y0, ahi = x ? c.x1 : c.y1;
  const double blo = x ? c.y0 : c.x0, bhi = x ? c.y1 : c.x1;
  int j0 = 0, j1 = 0, i0 = 0, i1 = 0;
  whole_pixels(&blo, &bhi, 1, b0_, per_pb_, rows_, &j0, &j1);
  whole_pixels(&alo, &ahi, 1, a0_, per_pa_, columns_, &i0, &i1);
  if (j0 >= j1 || i0 >= i1 || all_set({i0, i1 - 1}, {j0, j1 - 1})) return;
  const int n = j1 - j0;
  std::fill_n(left_.begin(), n, alo);
  std::fill_n(right_.begin(), n, ahi);
  const double from = b0_ + j0 * pb_, width = ahi - alo;
  const double reach = std::max(std::abs(from), std::abs(from + n * pb_));
  for (std::uint32_t k = 0; k < c.half_plane_count; ++k) {
    const HalfPlane& h = half_planes[k];
    const double na = x ? h.nx : h.ny, nb = x ? h.ny : h.nx;
    const double worst = nb > 0 ? from : from + pb_;  // of row 0
    // An edge along the rows: decided for the whole width at its worst place, no division.
    if (std::abs(na) * width <= 1e-6 * std::abs(nb) * pb_) {
      const double worst_a = std::min(na * alo, na * ahi);
      const double slack = 0x1p-48 * (std::abs(worst_a) + std::abs(nb) * reach + std::abs(h.c));
      for (int j = 0; j < n; ++j)
        if (!(nb * (worst + j * pb_) + worst_a >= h.c + slack)) left_[j] = kInfinity;
      continue;
    }
    const double slope = -nb / na, offset = h.c / na;
    const double slack = 0x1p-48 * (std::abs(offset) + std::abs(slope) * reach);
    if (na > 0)
      raise(left_.data(), n, offset + slack, slope, worst, pb_);
    else
      lower(right_.data(), n, offset - slack, slope, worst, pb_);
  }
  whole_pixels(left_.data(), right_.data(), n, a0_, per_pa_, columns_, first_.data(), end_.data());
  for (int j = 0; j < n; ++j) {
    if (first_[j] >= end_[j]) continue;
    std::uint64_t* row = row_bits(j0 + j);
    for_each_word(first_[j], end_[j] - 1, [&](int w, std::uint64_t mask) { row[w] |= mask; });
  }
}

}  // namespace pvsfarm

#include "worker/visibility/coverage_bits.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "common/base/check.hpp"
#include "worker/visibility/dispatch.hpp"
#include "worker/visibility/lanes.hpp"

namespace pvsfarm {
namespace {

constexpr int kLanes = 8;
constexpr Eight kLaneNumbers{0, 1, 2, 3, 4, 5, 6, 7};

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

// The lowest `count` bits, 0 .. 64.
PVSFARM_INLINE EightWords low_bits(const EightInts& count) {
  const EightWords n = __builtin_convertvector(count, EightWords);
  const EightWords one{1, 1, 1, 1, 1, 1, 1, 1};
  return n > 63 ? ~EightWords{} : (one << (n & 63)) - one;
}

// Sets the pixels of the shape in columns of words that are `stride` rows apart.
PVSFARM_DISPATCH
void fill_rows(const RowShape& shape, const BitGrid& grid, std::uint64_t* bits,
               std::size_t stride) {
  const Eight from = all_lanes(grid.a0), per_px = all_lanes(grid.per_pa);
  const Eight none = all_lanes(0), side = all_lanes(grid.columns), count = all_lanes(shape.count);
  for (int j = 0; j < shape.count; j += kLanes) {
    const Eight row = kLaneNumbers + all_lanes(j);
    Eight left = all_lanes(shape.left), right = all_lanes(shape.right);
    for (int k = 0; k < shape.left_count; ++k)
      left = larger(shape.lefts[k].at_first + row * shape.lefts[k].step, left);
    for (int k = 0; k < shape.right_count; ++k)
      right = smaller(shape.rights[k].at_first + row * shape.rights[k].step, right);
    // The pixels wholly inside: bounds have a margin of 10^-6 pixel or are the map's own border,
    // which rounding must not move.
    const Eight a = smaller(larger((left - from) * per_px - 0x1p-36, none), side);
    const Eight b = smaller(larger((right - from) * per_px + 0x1p-36, none), side);
    const EightInts floor_a = __builtin_convertvector(a, EightInts);
    const Eight up = __builtin_convertvector(floor_a, Eight) < a ? all_lanes(1) : none;
    const EightInts first = floor_a + __builtin_convertvector(up, EightInts);
    const Eight inside = row < count ? b : none;
    const EightInts end = __builtin_convertvector(inside, EightInts);
    const int last = static_cast<int>(largest(inside)) - 1;
    for (int w = static_cast<int>(smallest(a)) / 64; 64 * w <= last; ++w) {
      const EightInts at = first - 64 * w, to = end - 64 * w;
      const EightInts lo = at < 0 ? EightInts{} : at, hi = to < 0 ? EightInts{} : to;
      std::uint64_t* const words = bits + static_cast<std::size_t>(w) * stride + shape.first + j;
      const EightWords set = low_bits(hi) & ~low_bits(lo);
      store_lanes(words, load_lanes<EightWords>(words) | set);
    }
  }
}

// Whether all of `count` words have all bits of the mask.
PVSFARM_DISPATCH
bool all_set(const std::uint64_t* words, int count, std::uint64_t mask) {
  int i = count;
  for (; i >= 4 * kLanes; i -= 4 * kLanes) {
    EightWords met = load_lanes<EightWords>(words + i - kLanes);
    for (int k = 2; k <= 4; ++k) met &= load_lanes<EightWords>(words + i - k * kLanes);
    if (any_bits((met & mask) ^ mask)) return false;
  }
  EightWords met = ~EightWords{};
  for (; i >= kLanes; i -= kLanes) met &= load_lanes<EightWords>(words + i - kLanes);
  std::uint64_t last = ~0ull;
  for (; i > 0; --i) last &= words[i - 1];
  return (last & mask) == mask && !any_bits((met & mask) ^ mask);
}

// words[i] &= words[i + step], for all but the last few.
PVSFARM_DISPATCH
void fuse(std::uint64_t* words, std::size_t count, std::size_t step) {
  for (std::size_t i = 0; i + step + kLanes <= count; i += kLanes)
    store_lanes(words + i,
                load_lanes<EightWords>(words + i) & load_lanes<EightWords>(words + i + step));
}

// Every pixel and the one `step` < 64 after it in its row, of a map of `count` columns of words.
PVSFARM_DISPATCH
void fuse_along(std::uint64_t* words, std::size_t stride, int count, int step) {
  for (int w = 0; w < count; ++w, words += stride) {
    if (w + 1 == count) {
      for (std::size_t j = 0; j < stride; ++j) words[j] &= words[j] >> step;
    } else {
      const std::uint64_t* const next = words + stride;
      for (std::size_t j = 0; j < stride; ++j)
        words[j] &= (words[j] >> step) | (next[j] << (64 - step));
    }
  }
}

// out[j] &= the 64 pixels from `first` on of row j; beyond the row they are uncovered.
PVSFARM_DISPATCH
void keep_shifted(std::uint64_t* out, const std::uint64_t* words, std::size_t stride, int count,
                  int first) {
  const int word = first >> 6, shift = first & 63;
  const std::uint64_t* const low = words + word * static_cast<std::ptrdiff_t>(stride);
  const std::uint64_t* const high = low + stride;
  const bool has_low = word >= 0 && word < count;
  const bool has_high = shift != 0 && word + 1 >= 0 && word + 1 < count;
  if (has_low && has_high) {
    for (std::size_t j = 0; j < stride; ++j)
      out[j] &= (low[j] >> shift) | (high[j] << (64 - shift));
  } else if (has_low) {
    for (std::size_t j = 0; j < stride; ++j) out[j] &= low[j] >> shift;
  } else if (has_high) {
    for (std::size_t j = 0; j < stride; ++j) out[j] &= high[j] << (64 - shift);
  } else {
    std::fill_n(out, stride, 0);
  }
}

PVSFARM_DISPATCH
void add_bits(std::uint64_t* out, const std::uint64_t* words, std::size_t count,
              std::uint64_t valid) {
  for (std::size_t j = 0; j < count; ++j) out[j] |= words[j] & valid;
}

// Of lines from row 0 to row `last` drops those that one of two is never below: the one that is
// highest in the first row, and the one that is highest in the last. sign -1: never above, lowest.
int thinned(RowLine* lines, int count, int last, double sign) {
  if (count < 2) return count;
  const auto at_first = [&](int k) { return sign * lines[k].at_first; };
  const auto at_last = [&](int k) { return sign * (lines[k].at_first + last * lines[k].step); };
  int a = 0, b = 0;
  for (int k = 1; k < count; ++k) {
    if (at_first(k) > at_first(a)) a = k;
    if (at_last(k) > at_last(b)) b = k;
  }
  const double a_last = at_last(a), b_first = at_first(b);
  std::swap(lines[0], lines[a]);
  if (b == 0) b = a;
  int kept = 1;
  if (at_last(b) > a_last) std::swap(lines[kept++], lines[b]);
  for (int k = kept; k < count; ++k)
    if (at_first(k) > b_first && at_last(k) > a_last) lines[kept++] = lines[k];
  return kept;
}

// Along a row the footprint of pixel i is i + [first, last], nearly the same for neighbours where
// the grids are scaled alike: one shift for a word's 64, wide enough for all of them.
struct Shift {
  int first = 0, last = -1;
  std::uint64_t valid = 0;
};

Shift common_shift(const PixelSpan* spans, int first_pixel) {
  Shift shift;
  for (int i = first_pixel; i < first_pixel + 64; ++i) {
    const PixelSpan& span = spans[i];
    if (!span.valid()) continue;
    if (shift.valid == 0) shift = {span.first - i, span.last - i, 0};
    shift.first = std::min(shift.first, span.first - i);
    shift.last = std::max(shift.last, span.last - i);
    shift.valid |= 1ull << (i % 64);
  }
  return shift;
}

int power_of_two_below(int window) {
  return static_cast<int>(std::bit_floor(static_cast<unsigned>(window)));
}

}  // namespace

BitRange BitGrid::whole(double a_lo, double a_hi, double b_lo, double b_hi) const {
  const auto first = [](double at, int count) {
    return at > 0 ? static_cast<int>(std::ceil(std::min(at, static_cast<double>(count)))) : 0;
  };
  const auto last = [](double at, int count) {
    return at > 0 ? static_cast<int>(std::min(at, static_cast<double>(count))) - 1 : -1;
  };
  return {first((a_lo - a0) * per_pa - 0x1p-36, columns),
          last((a_hi - a0) * per_pa + 0x1p-36, columns),
          first((b_lo - b0) * per_pb - 0x1p-36, rows), last((b_hi - b0) * per_pb + 0x1p-36, rows)};
}

void RowShape::begin(const BitRange& range, double a_lo, double a_hi) {
  first = range.across_first;
  count = range.across_last - range.across_first + 1;
  left = a_lo;
  right = a_hi;
  left_count = right_count = 0;
}

void RowShape::thin_out() {
  left_count = thinned(lefts, left_count, count - 1, 1);
  right_count = thinned(rights, right_count, count - 1, -1);
}

void CoverageBits::reset(const SweepPlane& plane) {
  PVS_CHECK(plane.plane.resolution_px % 64 == 0);
  PVS_CHECK_LE(plane.plane.resolution_px, kMaxSweepPx);
  PVS_CHECK_LE(plane.row_count, plane.plane.resolution_px);
  where_ = plane;
  const bool x = plane.along == MapAxis::kX;
  const ProjectionPlane& p = plane.plane;
  grid_ = {x ? p.x0 : p.y0, x ? p.y0 : p.x0, x ? p.px : p.py, x ? p.py : p.px};
  grid_.per_pa = 1 / grid_.pa;
  grid_.per_pb = 1 / grid_.pb;
  grid_.columns = p.resolution_px;
  grid_.rows = plane.row_count;
  words_ = grid_.columns / 64;
  stride_ = (static_cast<std::size_t>(grid_.rows) + kLanes - 1) / kLanes * kLanes;
  bits_.assign(words_ * stride_ + kLanes, 0);
}

// Rounding of the product is below 10^-9 pixel; callers widen their rectangles by more.
BitRange CoverageBits::touched(const PlaneRect& rect) const {
  const auto pixel = [](double at, int count) {
    if (!(at >= 0)) return -1;
    return at < count ? static_cast<int>(at) : count;
  };
  const bool x = where_.along == MapAxis::kX;
  const double alo = x ? rect.x0 : rect.y0, ahi = x ? rect.x1 : rect.y1;
  const double blo = x ? rect.y0 : rect.x0, bhi = x ? rect.y1 : rect.x1;
  const BitGrid& g = grid_;
  return {pixel((alo - g.a0) / g.pa - 1e-9, g.columns),
          pixel((ahi - g.a0) / g.pa + 1e-9, g.columns), pixel((blo - g.b0) / g.pb - 1e-9, g.rows),
          pixel((bhi - g.b0) / g.pb + 1e-9, g.rows)};
}

bool CoverageBits::all_covered(const BitRange& range) const {
  bool all = true;
  for_each_word(range.along_first, range.along_last, [&](int w, std::uint64_t mask) {
    const std::uint64_t* const rows = column(w);
    // From above: what stands on the ground is closed below first.
    all = all && (mask & ~rows[range.across_last]) == 0 &&
          all_set(rows + range.across_first, range.across_last - range.across_first, mask);
  });
  return all;
}

bool CoverageBits::covered(const PlaneRect& rect) const {
  if (!(rect.x0 <= rect.x1 && rect.y0 <= rect.y1)) return false;  // NaN: doubt means visible
  const BitRange range = touched(rect);
  if (range.along_first < 0 || range.across_first < 0 || range.along_last >= grid_.columns ||
      range.across_last >= grid_.rows)
    return false;
  return all_covered(range);
}

std::uint64_t CoverageBits::covered_pixels() const {
  std::uint64_t sum = 0;
  for (int w = 0; w < words_; ++w)
    for (int j = 0; j < grid_.rows; ++j) sum += std::popcount(column(w)[j]);
  return sum;
}

void CoverageBits::cover_below(double level) {
  const BitGrid& g = grid_;
  int rows = 0;
  while (rows < g.rows && g.b0 + (rows + 1) * g.pb + 1e-9 * g.pb < level) ++rows;
  for (int w = 0; w < words_; ++w) std::fill_n(column(w), rows, ~0ull);
}

void CoverageBits::gather(const CoverageBits& from) {
  PVS_CHECK(from.where_.along == where_.along);
  PVS_CHECK_LE(from.where_.bound, where_.bound);
  const MapAxis across = where_.along == MapAxis::kX ? MapAxis::kY : MapAxis::kX;
  footprints(from.where_.plane, where_.plane, where_.along, along_spans_);
  footprints(from.where_.plane, where_.plane, across, across_spans_);

  std::array<Shift, kMaxSweepPx / 64> shifts;
  int window = grid_.columns, row_window = grid_.rows;
  for (int w = 0; w < words_; ++w) {
    shifts[w] = common_shift(along_spans_.data(), 64 * w);
    if (shifts[w].valid != 0) window = std::min(window, shifts[w].last - shifts[w].first + 1);
  }
  // Rows beyond those kept are uncovered.
  for (int j = 0; j < grid_.rows; ++j) {
    if (across_spans_[j].last >= from.grid_.rows) across_spans_[j] = {};
    if (across_spans_[j].valid()) row_window = std::min(row_window, across_spans_[j].size());
  }
  window = std::min(power_of_two_below(window), 64);
  row_window = power_of_two_below(row_window);

  // Bit i of row j: whether pixels i .. i + window - 1 of rows j .. j + row_window - 1 are all
  // covered. A row window that runs into the next column of words begins in no valid span.
  fused_.assign(from.bits_.begin(), from.bits_.end());
  for (int step = 1; step < window; step *= 2)
    fuse_along(fused_.data(), from.stride_, from.words_, step);
  for (int step = 1; step < row_window; step *= 2) fuse(fused_.data(), fused_.size(), step);

  picked_.assign(from.words_ * stride_, 0);
  for (int w = 0; w < from.words_; ++w) {
    const std::uint64_t* const rows = fused_.data() + w * from.stride_;
    std::uint64_t* const picked = picked_.data() + w * stride_;
    for (int j = 0; j < grid_.rows; ++j) {
      const PixelSpan& span = across_spans_[j];
      if (!span.valid()) continue;
      const int end = span.last + 1 - row_window;
      picked[j] = rows[end];
      for (int at = span.first; at < end; at += row_window) picked[j] &= rows[at];
    }
  }
  fused_.resize(std::max(fused_.size(), stride_));
  for (int w = 0; w < words_; ++w) {
    if (shifts[w].valid == 0) continue;
    std::fill_n(fused_.data(), stride_, ~0ull);
    const int end = shifts[w].last + 1 - window;
    for (int at = shifts[w].first; at < end; at += window)
      keep_shifted(fused_.data(), picked_.data(), stride_, from.words_, 64 * w + at);
    keep_shifted(fused_.data(), picked_.data(), stride_, from.words_, 64 * w + end);
    add_bits(column(w), fused_.data(), stride_, shifts[w].valid);
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
  double blo = x ? c.y0 : c.x0, bhi = x ? c.y1 : c.x1;
  const double width = ahi - alo, reach = std::max(std::abs(blo), std::abs(bhi));
  const auto flat = [&](double na, double nb) {
    return std::abs(na) * width <= 1e-6 * std::abs(nb) * grid_.pb;
  };
  // An edge along the rows: decided for the whole width at its worst place, no division by na.
  for (std::uint32_t k = 0; k < c.half_plane_count; ++k) {
    const HalfPlane& h = half_planes[k];
    const double na = x ? h.nx : h.ny, nb = x ? h.ny : h.nx;
    if (!flat(na, nb)) continue;
    if (nb == 0) return;  // no edge at all
    const double worst_a = std::min(na * alo, na * ahi);
    const double slack = 0x1p-47 * (std::abs(worst_a) + std::abs(nb) * reach + std::abs(h.c));
    const double level = (h.c + slack - worst_a) / nb;
    (nb > 0 ? blo : bhi) = nb > 0 ? std::max(blo, level) : std::min(bhi, level);
  }
  const BitRange range = grid_.whole(alo, ahi, blo, bhi);
  if (range.empty() || all_covered(range)) return;
  shape_.begin(range, alo, ahi);
  const double first_row = grid_.b0 + range.across_first * grid_.pb;
  for (std::uint32_t k = 0; k < c.half_plane_count; ++k) {
    const HalfPlane& h = half_planes[k];
    const double na = x ? h.nx : h.ny, nb = x ? h.ny : h.nx;
    if (flat(na, nb)) continue;
    const double slope = -nb / na, offset = h.c / na;
    const double slack = 0x1p-47 * (std::abs(offset) + std::abs(slope) * (reach + grid_.pb));
    const double worst = nb > 0 ? first_row : first_row + grid_.pb;
    if (na > 0)
      shape_.lefts[shape_.left_count++] = {offset + slack + slope * worst, slope * grid_.pb};
    else
      shape_.rights[shape_.right_count++] = {offset - slack + slope * worst, slope * grid_.pb};
  }
  shape_.thin_out();
  fill(shape_);
}

void CoverageBits::fill(const RowShape& shape) { fill_rows(shape, grid_, bits_.data(), stride_); }

}  // namespace pvsfarm

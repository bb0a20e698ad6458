// Points, rectangles and segments of the plane, in integers: for methods whose errors show in two
// dimensions already.
//
// [limit] coordinates below 2^30.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

namespace pvsfarm::reference {

struct FlatPoint {
  std::int64_t x = 0, y = 0;
  friend bool operator==(const FlatPoint&, const FlatPoint&) = default;
};

inline FlatPoint operator-(FlatPoint a, FlatPoint b) { return {a.x - b.x, a.y - b.y}; }
inline FlatPoint operator+(FlatPoint a, FlatPoint b) { return {a.x + b.x, a.y + b.y}; }

// Positive if a, b, c turn left.
inline std::int64_t turn(FlatPoint a, FlatPoint b, FlatPoint c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// Closed; flat ones are allowed, empty ones have lo > hi.
struct Rect {
  FlatPoint lo, hi;
  bool empty() const { return lo.x > hi.x || lo.y > hi.y; }
  std::array<FlatPoint, 4> corners() const { return {lo, {hi.x, lo.y}, hi, {lo.x, hi.y}}; }
  bool contains(FlatPoint p) const {
    return lo.x <= p.x && p.x <= hi.x && lo.y <= p.y && p.y <= hi.y;
  }
};

// Whether a closed segment meets a closed rectangle: no axis of either parts them.
inline bool meets(const Rect& rect, FlatPoint a, FlatPoint b) {
  if (std::max(a.x, b.x) < rect.lo.x || std::min(a.x, b.x) > rect.hi.x) return false;
  if (std::max(a.y, b.y) < rect.lo.y || std::min(a.y, b.y) > rect.hi.y) return false;
  int left = 0, right = 0;
  for (const FlatPoint c : rect.corners()) {
    const std::int64_t side = turn(a, b, c);
    left += side > 0;
    right += side < 0;
  }
  return left < 4 && right < 4;
}

}  // namespace pvsfarm::reference

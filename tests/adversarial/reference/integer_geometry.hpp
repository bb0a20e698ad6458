// Signs of determinants of integers, without rounding and without overflow.
//
// Source: theory C.4. [limit] of `determinant`: no entry beyond 2^20, then every partial sum is
// below 2^63. [limit] of everything else: no difference of coordinates beyond 2^40, in 128 bits.
#pragma once

#include <array>
#include <cstdint>

#include "common/geometry/vec.hpp"

namespace pvsfarm::reference {

inline constexpr std::int64_t kLargestEntry = std::int64_t{1} << 20;
inline constexpr std::int64_t kLargestDifference = std::int64_t{1} << 40;

struct IntPoint {
  std::int64_t v[3] = {0, 0, 0};
  std::int64_t operator[](int axis) const { return v[axis]; }
  std::int64_t& operator[](int axis) { return v[axis]; }
  friend bool operator==(const IntPoint&, const IntPoint&) = default;
};

IntPoint operator-(const IntPoint& a, const IntPoint& b);
inline Vec3 to_vec(const IntPoint& p) {
  return Vec3{static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

// det[p, q, r] in 64 bits. Requires: no entry beyond kLargestEntry.
std::int64_t determinant(const IntPoint& p, const IntPoint& q, const IntPoint& r);

// Sign of det[b - a, c - a, d - a]: positive if d lies where a, b, c look counter-clockwise from.
int orientation(const IntPoint& a, const IntPoint& b, const IntPoint& c, const IntPoint& d);

// A closed box of integer corners; flat ones are allowed.
struct IntBox {
  IntPoint lo, hi;
  // As Box::corner.
  IntPoint corner(int k) const {
    return {{(k & 1) ? hi[0] : lo[0], (k & 2) ? hi[1] : lo[1], (k & 4) ? hi[2] : lo[2]}};
  }
  std::array<IntPoint, 8> corners() const {
    std::array<IntPoint, 8> all;
    for (int k = 0; k < 8; ++k) all[k] = corner(k);
    return all;
  }
};

// Whether the segment from a to b crosses the triangle c, d, e in its inside. kDegenerate: a sign
// that decides is zero (it meets an edge, a vertex or the plane); neither answer may be built on.
enum class Stab { kMiss, kHit, kDegenerate };
Stab stab(const IntPoint& a, const IntPoint& b, const IntPoint& c, const IntPoint& d,
          const IntPoint& e);

}  // namespace pvsfarm::reference

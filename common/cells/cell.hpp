// Viewing cells: closed oriented boxes, and their exact splitting.
#pragma once

#include <array>
#include <cstdint>
#include <utility>

#include "common/base/digest.hpp"
#include "common/geometry/box.hpp"

namespace pvsfarm {

// The set { origin + sum_a t[a] * axes[a] : lo[a] <= t[a] <= hi[a] }. [units] scene units, z up.
// Axes are unit vectors, orthogonal up to kAxisTolerance; an axis-aligned cell has origin 0 and the
// coordinate axes, so lo and hi are its very coordinates. Zero extent is allowed.
struct Cell {
  Vec3 origin{0};
  std::array<Vec3, 3> axes{Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
  Vec3 lo{0}, hi{0};

  static Cell aligned(const Box& box) { return Cell{.lo = box.lo, .hi = box.hi}; }
  Vec3 point(const Vec3& t) const { return origin + axes[0] * t.x + axes[1] * t.y + axes[2] * t.z; }
  Vec3 corner(int k) const { return point(Box{lo, hi}.corner(k)); }
  Vec3 center() const { return point(lo * 0.5 + hi * 0.5); }
  Vec3 half() const { return (hi - lo) * 0.5; }
  Box bounds() const;       // an axis-aligned box around the cell, rounded outwards
  int longest_axis() const;  // the lowest of equals
  friend bool operator==(const Cell&, const Cell&) = default;
};

inline constexpr double kAxisTolerance = 1e-6;

// The two halves of `cell` along `axis`. They share the split coordinate bit for bit, and their
// union is `cell`. Requires lo < mid < hi after rounding (see can_split).
std::pair<Cell, Cell> split(const Cell& cell, int axis);
bool can_split(const Cell& cell, int axis);

void add_to_digest(DigestBuilder& digest, const Cell& cell);

}  // namespace pvsfarm

// The union of the segments between two boxes: their convex hull, in half-spaces.
//
// Source: Haines & Wallace 1991, "Shaft culling". Six sides are those of the box around both; the
// others are parallel to an axis, two at most to each, and touch both boxes.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "common/geometry/box.hpp"

namespace pvsfarm {

// Threads: const after construction.
class Shaft {
 public:
  // Wider than the hull by `margin`, which is more than points are off by rounding.
  Shaft(const Box& from, const Box& to, double margin);

  // Whether the segment surely does not meet the shaft.
  bool misses(const Vec3& a, const Vec3& b) const {
    double first = 0, last = 1;
    for (int axis = 0; axis < 3; ++axis) {
      if (clipped(around_.lo[axis] - a[axis], around_.lo[axis] - b[axis], first, last) ||
          clipped(a[axis] - around_.hi[axis], b[axis] - around_.hi[axis], first, last))
        return true;
    }
    for (int k = 0; k < count_; ++k) {
      const Side& side = sides_[k];
      if (clipped(side.nu * a[side.u] + side.nv * a[side.v] - side.most,
                  side.nu * b[side.u] + side.nv * b[side.v] - side.most, first, last))
        return true;
    }
    return first > last;
  }

 private:
  // nu x_u + nv x_v <= most
  struct Side {
    int u, v;
    double nu, nv, most;
  };

  // Takes from the part (first, last) of a segment what lies outside, if the ends lie so far
  // outside. Whether all of the segment does.
  static bool clipped(double at_a, double at_b, double& first, double& last) {
    if (at_a > 0) {
      if (at_b > 0) return true;
      first = std::max(first, at_a / (at_a - at_b));
    } else if (at_b > 0) {
      last = std::min(last, at_a / (at_a - at_b));
    }
    return false;
  }

  Box around_;
  std::array<Side, 6> sides_;
  int count_ = 0;
};

// Any direction gives a valid side, as far as both boxes reach along it: rounding of the direction
// does no harm.
inline Shaft::Shaft(const Box& from, const Box& to, double margin) : around_(from) {
  around_.add(to);
  around_.lo -= Vec3(margin);
  around_.hi += Vec3(margin);
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int corner = 0; corner < 4 && count_ < 6; ++corner) {
      const bool high_u = (corner & 1) != 0, high_v = (corner & 2) != 0;
      const auto at = [&](const Box& box, int a, bool high) {
        return high ? box.hi[a] : box.lo[a];
      };
      const double du = at(to, u, high_u) - at(from, u, high_u);
      const double dv = at(to, v, high_v) - at(from, v, high_v);
      // At right angles to the line between like corners, outwards for both.
      const double su = high_u ? 1 : -1, sv = high_v ? 1 : -1;
      double nu = su * std::abs(dv), nv = sv * std::abs(du);
      if (!(nu != 0 && nv != 0) || ((du > 0) == (dv > 0)) != (high_u != high_v)) continue;
      const double size = std::abs(nu) + std::abs(nv);
      nu /= size;
      nv /= size;
      const auto reach = [&](const Box& box) {
        return nu * at(box, u, nu > 0) + nv * at(box, v, nv > 0);
      };
      sides_[count_++] = {u, v, nu, nv, std::max(reach(from), reach(to)) + margin};
    }
  }
}

}  // namespace pvsfarm

// The union of the segments between two boxes: their convex hull, in half-spaces.
//
// Source: Haines & Wallace 1991, "Shaft culling". Six sides are those of the box around both; the
// others are parallel to an axis, two at most to each, and touch both boxes.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "common/geometry/box.hpp"

namespace pvsfarm {

// Threads: const after construction.
class Shaft {
 public:
  // Wider than the hull by `margin`, which is more than points are off by rounding.
  Shaft(const Box& from, const Box& to, double margin);

  // lies_beyond[i] = 1: both ends of segment i lie beyond one side, so that it misses the shaft.
  // `ends`: columns of the first ends' x, y, z and of the second ends'.
  void find_beyond(const std::array<const double*, 6>& ends, std::size_t n,
                   double* lies_beyond) const;

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
  static constexpr int kMostSides = 6;
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
  std::array<Side, kMostSides> sides_;
  int count_ = 0;
};

}  // namespace pvsfarm

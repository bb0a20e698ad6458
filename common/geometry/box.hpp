// Axis-aligned boxes, closed: a point on the border belongs to the box.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "common/geometry/vec.hpp"

namespace pvsfarm {

struct Box {
  Vec3 lo{std::numeric_limits<double>::infinity()};
  Vec3 hi{-std::numeric_limits<double>::infinity()};

  bool empty() const { return !(lo.x <= hi.x && lo.y <= hi.y && lo.z <= hi.z); }
  Vec3 center() const { return lo * 0.5 + hi * 0.5; }
  Vec3 size() const { return hi - lo; }
  // Corner k: bit 0 picks x, bit 1 y, bit 2 z; a set bit means hi.
  Vec3 corner(int k) const {
    return {(k & 1) ? hi.x : lo.x, (k & 2) ? hi.y : lo.y, (k & 4) ? hi.z : lo.z};
  }
  void add(const Vec3& p) {
    for (int a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], p[a]);
      hi[a] = std::max(hi[a], p[a]);
    }
  }
  void add(const Box& b) {
    for (int a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], b.lo[a]);
      hi[a] = std::max(hi[a], b.hi[a]);
    }
  }
  bool contains(const Vec3& p) const {
    return lo.x <= p.x && p.x <= hi.x && lo.y <= p.y && p.y <= hi.y && lo.z <= p.z && p.z <= hi.z;
  }
  bool meets(const Box& b) const {
    return lo.x <= b.hi.x && b.lo.x <= hi.x && lo.y <= b.hi.y && b.lo.y <= hi.y &&
           lo.z <= b.hi.z && b.lo.z <= hi.z;
  }
};

// 63-bit Morton code of `p` inside `bounds`: 21 bits an axis, x lowest.
std::uint64_t morton_code(const Vec3& p, const Box& bounds);

}  // namespace pvsfarm

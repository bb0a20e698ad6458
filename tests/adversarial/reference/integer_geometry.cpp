#include "tests/adversarial/reference/integer_geometry.hpp"

#include <cstdlib>

#include "common/base/check.hpp"

namespace pvsfarm::reference {

IntPoint operator-(const IntPoint& a, const IntPoint& b) {
  return {{a[0] - b[0], a[1] - b[1], a[2] - b[2]}};
}

std::int64_t determinant(const IntPoint& p, const IntPoint& q, const IntPoint& r) {
  for (int k = 0; k < 3; ++k)
    for (const IntPoint* row : {&p, &q, &r}) PVS_CHECK_LE(std::abs((*row)[k]), kLargestEntry);
  return p[0] * (q[1] * r[2] - q[2] * r[1]) + p[1] * (q[2] * r[0] - q[0] * r[2]) +
         p[2] * (q[0] * r[1] - q[1] * r[0]);
}

int orientation(const IntPoint& a, const IntPoint& b, const IntPoint& c, const IntPoint& d) {
  const IntPoint p = b - a, q = c - a, r = d - a;
  for (int k = 0; k < 3; ++k)
    for (const IntPoint* row : {&p, &q, &r}) PVS_CHECK_LE(std::abs((*row)[k]), kLargestDifference);
  const auto minor = [&](int i, int j) {
    return static_cast<__int128>(q[i]) * r[j] - static_cast<__int128>(q[j]) * r[i];
  };
  const __int128 det = p[0] * minor(1, 2) + p[1] * minor(2, 0) + p[2] * minor(0, 1);
  return det > 0 ? 1 : det < 0 ? -1 : 0;
}

Stab stab(const IntPoint& a, const IntPoint& b, const IntPoint& c, const IntPoint& d,
          const IntPoint& e) {
  const int start = orientation(c, d, e, a), end = orientation(c, d, e, b);
  if (start * end > 0) return Stab::kMiss;
  const int sides[3] = {orientation(a, b, c, d), orientation(a, b, d, e), orientation(a, b, e, c)};
  bool left = false, right = false, zero = start == 0 || end == 0;
  for (const int side : sides) {
    left |= side > 0;
    right |= side < 0;
    zero |= side == 0;
  }
  if (left && right) return Stab::kMiss;
  return zero ? Stab::kDegenerate : Stab::kHit;
}

}  // namespace pvsfarm::reference

// Whether points lie on one line, in one plane, or turn left, decided without rounding.
//
// Source: Shewchuk 1997, Adaptive Precision Floating-Point Arithmetic: a filter, and where it
// cannot tell, the determinant as an exact sum of doubles.
#pragma once

#include "common/geometry/vec.hpp"

namespace pvsfarm {

// True only if the points, taken as the exact reals their doubles are, lie on one line. False for
// every triple that does not, and for coordinates so near to 0 that their products underflow.
// Requires: coordinates below 1e150.
bool is_collinear(const Vec3& a, const Vec3& b, const Vec3& c);

// True only if `p` lies on the line between `a` and `b` and is neither: as exact as above.
bool is_inside_edge(const Vec3& p, const Vec3& a, const Vec3& b);

// True only if the points lie in one plane: as exact as above. Requires: coordinates below 1e100.
bool is_coplanar(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

// 1 if a, b, c turn left as seen along -`axis` (0: x, with y to the right), -1 if they turn right;
// 0 if they are in line or it cannot be told: as exact as above.
int turn(const Vec3& a, const Vec3& b, const Vec3& c, int axis);

}  // namespace pvsfarm

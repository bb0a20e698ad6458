// Distances of segments to segments and triangles, in double, to a few units of rounding.
#pragma once

#include "common/geometry/vec.hpp"

namespace pvsfarm {

// From the segment a-b to the longest side of a triangle that has hardly any area.
double segment_distance(const Vec3& a, const Vec3& b, const Vec3 (&triangle)[3]);
// From the segment a-b to a triangle; 0 if they meet.
double triangle_distance(const Vec3& a, const Vec3& b, const Vec3 (&triangle)[3]);

}  // namespace pvsfarm

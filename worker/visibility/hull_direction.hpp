// In which direction, and how far, a convex set of points lies.
#pragma once

#include <span>

#include "common/geometry/vec.hpp"

namespace pvsfarm {

// From `eye` to about the closest point of the hull of `points`; about 0 if the eye is inside.
// Source: Frank and Wolfe 1956, a fixed number of steps. Not exact: whoever concludes anything from
// the direction checks it. Requires: at least one point.
Vec3 toward_hull(std::span<const Vec3> points, const Vec3& eye);

}  // namespace pvsfarm

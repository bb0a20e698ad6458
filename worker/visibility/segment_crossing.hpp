// Whether a segment crosses the inside of a triangle, where that is beyond doubt.
#pragma once

#include <array>
#include <optional>

#include "common/geometry/box.hpp"

namespace pvsfarm {

// `scale`: all points are off by at most 2^-44 of it, and no coordinate is larger. None: doubt.
std::optional<bool> crosses_triangle(const Vec3& from, const Vec3& to,
                                     const std::array<Vec3, 3>& triangle, double scale);

}  // namespace pvsfarm

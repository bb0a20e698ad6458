// Directed rounding to float: occluder depths round up, occludee depths round down (theory 0.5).
#pragma once

#include <cmath>
#include <limits>

namespace pvsfarm {

inline float float_not_below(double v) {
  const float f = static_cast<float>(v);
  return static_cast<double>(f) >= v ? f
                                     : std::nextafter(f, std::numeric_limits<float>::infinity());
}
inline float float_not_above(double v) {
  const float f = static_cast<float>(v);
  return static_cast<double>(f) <= v ? f
                                     : std::nextafter(f, -std::numeric_limits<float>::infinity());
}

}  // namespace pvsfarm

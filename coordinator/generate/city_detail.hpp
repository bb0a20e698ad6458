// What makes a generated city heavy: ledges on fronts, and cars of many triangles. The outlines
// stay those of the plain city, so that what hides what stays nearly the same.
// Requires of all: coordinates already snapped.
#pragma once

#include "common/geometry/box.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm {

inline constexpr int kTrianglesPerLedge = 12;
// How far a ledge stands out: less than cells keep off the fronts (kClearOfFronts_m).
inline constexpr double kLedgeDepth_m = 0.1875;

// `count` closed ledges in rows on those sides of `building` that lie in the sides of `block`.
void add_ledges(SourceObject& object, const Box& building, const Box& block, int count);

struct CarShape {
  Box body;         // from the ground to the waist, wheels included
  Box cabin, roof;  // see add_frustum
};
inline constexpr int kPlainCarTriangles = 24;
inline constexpr int kMinDetailedCarTriangles = 200, kMaxDetailedCarTriangles = 20'000;
// A tessellated closed body and cabin on four closed wheels, within `shape`, of exactly `triangles`
// triangles.
// Requires: a multiple of 4 in the range above.
void add_detailed_car(SourceObject& car, const CarShape& shape, int triangles);

}  // namespace pvsfarm

// Random scenes at the limit of what the improved Projection may hide.
#pragma once

#include <cstdint>
#include <vector>

#include "tests/adversarial/reference/improved_reference.hpp"

namespace pvsfarm::reference {

// The double nearest to a decimal of 6 places.
double decimal(double x);

struct ImprovedScene {
  ImprovedQuery query;         // the plane is z = 0
  PlaneRectangle rectangle;    // an improved Projection of the occludee,
  std::vector<Vec3> occluder;  // and one convex polygon that just covers it from all of the cell
};

// Whether the rectangle is taken from the front face or, as printed, from the whole cell depends on
// the seed. The polygon covers `slack` times the size of the rectangle more on each side.
ImprovedScene improved_scene(std::uint64_t seed, double slack);

}  // namespace pvsfarm::reference

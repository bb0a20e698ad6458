// Where a generated scene stands: turned about the z axis through the origin, then moved.
//
// Streets askew to the axes, and coordinates far from the origin, are what real scenes have and
// generators do not: cells stay along the streets, as oriented boxes, and nothing else changes.
#pragma once

#include "coordinator/generate/generated_scene.hpp"

namespace pvsfarm {

struct Placement {
  double rotate_deg = 0;  // counter-clockwise, seen from above
  Vec2 move_m{0};
};

// Quarter turns and moves by multiples of 1/1024 m keep every coordinate a multiple of 1/1024 m
// and every cell along the axes. After any other turn coordinates are doubles as they come: OBJ
// holds them all, GLB rounds them to float32. The same on every machine.
// Errors: kCommandLine, if a number is not finite or a coordinate gets beyond kMostPlaced_m.
Status place(GeneratedScene& scene, const Placement& placement);

inline constexpr double kMostPlaced_m = 1e8;

}  // namespace pvsfarm

// Turns a blocked line of sight past an edge of what blocks it: through a point just beside the
// edge, from the same eye to another point of the target, or to the same point from another eye of
// the cell. This finds slits that no random line would.
#pragma once

#include <cstdint>

#include "common/base/ids.hpp"
#include "common/base/random.hpp"
#include "common/cells/cell.hpp"
#include "common/scene/scene.hpp"
#include "worker/visibility/aim_points.hpp"
#include "worker/visibility/sight_check.hpp"

namespace pvsfarm {

struct BlockedAim {
  Vec3 eye{0};
  AimPoint aim;
  ObjectId target{};
  SightCheck::Hit blocker;
};

// Changes `blocked`'s eye, or its aim; false: the line drawn misses cell and target. The line
// passes the edge by `margin` or more.
bool escape(const Scene& scene, const Cell& cell, double margin, Random& random,
            BlockedAim& blocked);

}  // namespace pvsfarm

// The PVS that every root cell starts from.
#pragma once

#include "common/pvs/visible_set.hpp"
#include "common/scene/scene.hpp"

namespace pvsfarm {

// The PVS of the whole scene: every occludee.
VisibleSet all_occludees(const Scene& scene);

}  // namespace pvsfarm

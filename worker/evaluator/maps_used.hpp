// What a round of the cascade worked on, as its statistics tell it.
#pragma once

#include "common/pvs/rounds.hpp"
#include "worker/visibility/cell_frame.hpp"

namespace pvsfarm {

// One plane more.
void add_plane(const ProjectionPlane& plane, MapsUsed& maps);

}  // namespace pvsfarm

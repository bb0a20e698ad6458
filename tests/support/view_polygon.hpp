// One view of a convex piece as a polygon of window pixels, shrunk so that a pixel whose centre it
// holds is covered wholly. The tests' own code, from the theory and not from worker/.
#pragma once

#include <vector>

#include "worker/visibility/cell_frame.hpp"
#include "worker/visibility/occluder_pieces.hpp"

namespace pvsfarm {

// The view of `piece` from vertex `viewpoint` of the cell (bits: x, y, front face), moved inwards
// by 1/2 + 1/16 pixel (theory A.5) by clipping the window to the moved half-planes. Empty if
// nothing is left.
std::vector<Vec2> shrunk_view(const Piece& piece, const ProjectionPlane& plane, int viewpoint);

}  // namespace pvsfarm

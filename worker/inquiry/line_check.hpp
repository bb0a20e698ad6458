// A certificate, checked by other means than those that made it: lines against triangles.
#pragma once

#include "common/pvs/inquiry.hpp"
#include "common/scene/scene.hpp"
#include "worker/visibility/sight_check.hpp"

namespace pvsfarm {

// Draws lines from the cell's corners and from all over it to the corners of every part of the
// object's box and all over that, and notes in `finding` how many, and those that clear all opaque
// matter but the object's own by SightCheck's margin. Of a part that is `by_lines`, fills in who
// blocks them, and how many are blocked.
void check_by_lines(const Scene& scene, const SightCheck& sight, const ExplainQuestion& question,
                    ExplainFinding& finding);

// What of the part, or of the group, lies in the object's box: all that is of interest of it.
Box common_box(const Box& part, const Box& object);

}  // namespace pvsfarm

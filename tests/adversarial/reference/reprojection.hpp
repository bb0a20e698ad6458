// Re-projection of an occlusion map onto a farther plane, and how far that plane may be.
//
// Source: Durand 2000, 5; theory B.1, B.2, I 3 and 4. As printed the depth becomes the first
// plane's, which is wrong for occluders behind it, and the spacing lacks the resolution.
#pragma once

#include <optional>

#include "worker/visibility/occlusion_map.hpp"

namespace pvsfarm::reference {

// Where rays from the cell to [lo, hi] on `to` cross `from`, along x (axis 0) or y.
struct Footprint {
  double lo, hi;
};
Footprint footprint(const ProjectionPlane& from, const ProjectionPlane& to, int axis, double lo,
                    double hi);

enum class Depth { kResetToPlane, kKept };
// Requires: planes of one face of one cell, `to` the farther; `to` is empty.
void reproject(const OcclusionMap& from, OcclusionMap& to, Depth depth);

// The distance between planes at which the kernel has `kernel_px` pixels.
struct Spacing {
  double distance = 0;     // of the first plane from the (flat) cell
  double cell_width = 0;   // of the cell
  double plane_width = 0;  // of the second plane's rectangle
  int resolution_px = 0, kernel_px = 0;
};
double spacing(const Spacing& s);
double spacing_as_printed(const Spacing& s);  // proceedings version
// The kernel on the second plane, in pixels, for planes `apart`.
double kernel_px(const Spacing& s, double apart);

// The papers' form: the covered pixels of `from` eroded by a kernel of kernel_px x kernel_px, the
// inverse image of the equivalent cell, a flat rectangle before the cell that every ray crosses.
// The plane is as far out as that kernel allows, its grid that of `from` scaled from the cell;
// depths are kept. None: the kernel allows no farther plane.
// Requires: `from` symmetric about the cell's axis; kernel_px odd.
std::optional<OcclusionMap> convolve(const OcclusionMap& from, int kernel_px);

}  // namespace pvsfarm::reference

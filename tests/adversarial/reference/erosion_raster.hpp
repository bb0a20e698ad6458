// Erosion on pixels: eroded occluders and shrunk occludees drawn from one point before the +z face
// of a cell, in a view of 90 degrees.
//
// Source: Décoret 2003, 5 and 7 ("sampling is not an issue"); theory E.2 to E.5, I 35. As printed a
// pixel is what lies under its middle, for occluders and for occludees; so slits between middles
// close, and an object between middles is nowhere. Conservative: an occluder owns the pixels it
// covers wholly, an occludee those it touches.
#pragma once

#include <vector>

#include "common/geometry/box.hpp"

namespace pvsfarm::reference {

enum class Sampling { kPixelMiddles, kConservative };

struct RasterQuery {
  Box cell, occludee;  // the occludee beyond the +z face, or nothing is hidden
  std::vector<Box> boxes;
  int resolution_px = 64;
};

// Eroded by the gate: where rays to the occludee cross the plane of the face. Doubles, with margins
// of 1e-9; what is nearer than that to a pixel's border counts as uncovered.
bool hides_by_raster(const RasterQuery& query, Sampling sampling);

}  // namespace pvsfarm::reference

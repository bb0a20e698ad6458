// The extended Projection of a convex piece: the intersection of its views from the cell.
//
// Source: Durand 2000, 3.2; theory A.4 (rule V, step 4), A.5. A piece on one side of the plane is
// covered from every viewpoint of the cell where it is covered from the eight vertices (vertex
// lemma); a polygon with the cell on one side, wherever it lies (docs/algorithm.md, "polygons").
// Each view is a set of half-planes; the Projection is all of them together, never their vertices.
#pragma once

#include <vector>

#include "worker/visibility/cell_frame.hpp"
#include "worker/visibility/occluder_pieces.hpp"
#include "worker/visibility/occlusion_map.hpp"

namespace pvsfarm {

// nx * x + ny * y >= c. Rounding is already in c: points that fulfil it in exact arithmetic are
// covered.
struct HalfPlane {
  double nx, ny, c;
};

// A rectangle and half-planes whose common part is covered, at `depth` (rounded up).
struct Coverage {
  double x0, y0, x1, y1;
  float depth;
  std::uint32_t first_half_plane, half_plane_count;
};

// Coverages of one plane, for a rasteriser. Reused from plane to plane: no allocation once warm.
struct CoverageList {
  std::vector<Coverage> coverages;
  std::vector<HalfPlane> half_planes;
  void clear() {
    coverages.clear();
    half_planes.clear();
  }
};

// Appends the piece's Projection, if it can hold a whole pixel. `frame_scale`: CellFrame::
// offset_scale(). Returns whether anything was added.
//
// `drawn`, if any, is a map of that plane: what need not be drawn there (needs_nothing) is left
// out.
bool project(const Piece& piece, const ProjectionPlane& plane, double frame_scale,
             CoverageList& out, const OcclusionMap* drawn = nullptr);

}  // namespace pvsfarm

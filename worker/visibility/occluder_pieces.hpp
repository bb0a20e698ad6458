// From an occluder of the scene to convex pieces on one side of a projection plane.
//
// Source: theory A.4, Rule V. Differs from Durand 2000, 3.2: an occluder that crosses the plane is
// split at it; projecting it whole is unsound (adversarial case straddle_box).
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "common/scene/scene.hpp"
#include "worker/visibility/cell_frame.hpp"

namespace pvsfarm {

inline constexpr int kMaxPiecePoints = 64;  // occluders that need more are left out: always safe

// An occluder legal for the cell, in the local frame.
struct LocalOccluder {
  const Occluder* source = nullptr;
  Box box;                                         // of its points, ground extension included
  std::uint32_t first_point = 0, point_count = 0;  // into LocalOccluders::points
  bool solid = false;  // hull of the points is matter; else a polygon in order
  bool box_shaped =
      false;  // solid, an axis-aligned box of this very frame: `box` says it all, no points
  double flatness = 0;     // polygons
  double solid_angle = 0;  // [sr] roughly, from the cell's centre
};

struct LocalOccluders {
  std::vector<LocalOccluder> list;
  std::vector<Vec3> points;
  std::span<const Vec3> points_of(const LocalOccluder& o) const {
    return std::span(points).subspan(o.first_point, o.point_count);
  }
};

// Whether theory 0.2 lets `occluder` block rays that leave the cell, near clip included.
// A polygon must have the whole cell strictly on one side: one that is cut by the cell blocks
// nothing from every viewpoint.
bool legal_for_cell(const Scene& scene, const Occluder& occluder, const CellFrame& frame,
                    double near_m);

// Adds the occluder in local coordinates; solids on the ground reach down by `ground_depth` > 0
// (phantom matter, theory 0.3), or not at all for 0.
void add_local(const Scene& scene, const Occluder& occluder, const CellFrame& frame,
               double ground_depth, double solid_angle, LocalOccluders& out);

// Where matter begins to be projected: nearer to the cell than this, alpha has no bound.
inline double nearest_depth(const ProjectionPlane& plane, double near_m) {
  return -plane.distance + std::max(plane.distance / 64, near_m);
}

// One convex piece in plane coordinates. Solid: all of it at z <= 0 or all at z >= 0.
struct Piece {
  int point_count = 0;
  bool solid = false;
  bool box_shaped = false;  // the piece is `box`, the points its corners (Box::corner)
  Box box;                  // plane frame
  double flatness = 0;
  // polygons: the edges from these points to the next are cuts, the near and the far one; -1: none.
  std::array<int, 2> cut_edges{-1, -1};
  double cut_sine = 1;  // sine of the angle between polygon and cutting planes
  std::array<Vec3, kMaxPiecePoints> points;
};

// Rule V, steps 1 to 3: clips to z >= -D + delta and splits solids at z = 0. A polygon that crosses
// z = 0 stays whole, and its part before the plane is a piece once more, with a smaller Depth.
// Returns how many pieces were written.
int make_pieces(const LocalOccluders& all, const LocalOccluder& occluder,
                const ProjectionPlane& plane, double near_m, std::array<Piece, 2>& pieces);

}  // namespace pvsfarm

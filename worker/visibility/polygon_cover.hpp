// The short way from a small polygon to the bits of a sweep: what make_pieces, project and
// CoverageBits::draw do for any occluder, for triangles and quads eight views at once. A scene of
// leaves is little else.
//
// Source: as projection.hpp. The polygon is cut behind the map's bound, not at the plane: what lies
// between counts, too.
#pragma once

#include <span>

#include "worker/visibility/coverage_bits.hpp"

namespace pvsfarm {

// What all polygons of one plane share.
struct PolygonPlane {
  int along = 0, across = 0, away = 0;  // the local axes; polygons lie away from the face
  double sign = 1;                      // of the face
  double half_along = 0, half_across = 0, half_away = 0;  // of the cell
  double front = 0, back = 0;                             // from the cell's faces to the plane
  double nearest = 0, deepest = 0;  // where matter counts, in depths of the plane
  double frame_scale = 0;
};
// `nearest`: nearest_depth() of the plane.
PolygonPlane polygon_plane(const SweepPlane& where, double nearest, double frame_scale);

// +1 if the whole cell lies strictly before the polygon of the local frame, -1 strictly behind, 0
// neither: then it blocks nothing from every viewpoint.
int side_of_cell(std::span<const Vec3> local, double flatness, const CellFrame& frame);

inline constexpr std::size_t kMaxCoverPoints = 4;

enum class Cover {
  kAdded,    // pixels, perhaps
  kNothing,  // it covers none that was open
  kLongWay,  // not for this function: too near, too many points, or too deep and not flat
};

// Covers the Projection of a polygon of the local frame that is legal for the cell, with all its
// matter within `flatness` of one plane. `shape` is room for work.
Cover cover_polygon(const PolygonPlane& plane, std::span<const Vec3> local, double flatness,
                    CoverageBits& map, RowShape& shape);

}  // namespace pvsfarm

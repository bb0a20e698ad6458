// The improved Projection of an occludee before the projection plane, and its test against convex
// occluders that lie before the plane too.
//
// Source: Durand 2000 (extended version), 4; theory A.10, I 2. As printed the rectangle is the
// product of two intervals, each taken from all of the cell; for a deep cell such a product mixes
// different depths of it, and the cones of its points do not hold the occludee.
#pragma once

#include <vector>

#include "tests/support/exact_oracle.hpp"

namespace pvsfarm::reference {

// Where the views are taken from that the rectangle must meet.
enum class ViewedFrom {
  kWholeCell,  // as printed
  kFrontFace,  // one depth of the cell: then a product of intervals is a view
};

struct ImprovedQuery {
  Box cell;
  Box occludee;
  double plane_z = 0;  // the plane is across z, beyond the cell and not before the occludee
};

// A rectangle on the plane that meets the view of every vertex of the occludee; widened to the grid
// of the exact oracle. Where the vertices have a view in common (beyond the "vanishing point"): the
// middle of it.
struct PlaneRectangle {
  double lo[2], hi[2];
};
PlaneRectangle improved_projection(const ImprovedQuery& query, ViewedFrom from);

// What may certify a point of the plane.
enum class Umbra {
  kOneOccluder,   // one convex occluder covers it from every vertex of the cell
  kAllOccluders,  // from every vertex some occluder does: not enough (the paper's figure 9)
};

// Whether every point of the improved Projection is certified, by occluders before the plane and
// before the occludee. Exact. Requires: coordinates are decimals of at most 6 places.
bool hides_improved(const std::vector<std::vector<Vec3>>& convex_polygons,
                    const ImprovedQuery& query, ViewedFrom from, Umbra umbra);

}  // namespace pvsfarm::reference

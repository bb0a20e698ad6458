// Membership in the erosion of a polygon by a convex set X: { v : v + X inside the polygon }.
//
// Source: Décoret 2003, 4.3 and figure 5; theory E.3, I 34. As printed, the edges swept by -X are
// taken away from the polygon itself. That is right only if X holds the origin; else the polygon
// must be moved first, and the sweep be that of X moved to hold it.
#pragma once

#include <vector>

#include "tests/adversarial/reference/flat_geometry.hpp"

namespace pvsfarm::reference {

using Polygon = std::vector<FlatPoint>;  // simple, counter-clockwise

bool contains(const Polygon& polygon, FlatPoint p);               // closed
bool in_hull(const std::vector<FlatPoint>& points, FlatPoint p);  // closed, of any few points

bool in_erosion_as_printed(const Polygon& polygon, const std::vector<FlatPoint>& x, FlatPoint v);
bool in_erosion(const Polygon& polygon, const std::vector<FlatPoint>& x, FlatPoint v);

}  // namespace pvsfarm::reference

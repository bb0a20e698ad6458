// The improved Projection of occludees: a smaller rectangle for what lies before the plane.
//
// Source: Durand 2000 (extended version), 4; theory A.10. Before the plane the union of the views
// of a box is much wider than the box; a rectangle that meets the views of each of its vertices is
// enough, if every pixel that it touches carries a cone certificate (docs/algorithm.md, A.10, says
// which do: all of rule V; not those of surfaces).
// Differs from Durand 2000: the views are those from the front face of the cell (the product of
// intervals taken from all of a deep cell is unsound, adversarial case improved_deep_cell); where
// the views have points in common, all of these are searched, not the middle one alone.
#pragma once

#include <optional>

#include "worker/visibility/occlusion_map.hpp"

namespace pvsfarm {

// Whether `local_box` is hidden: its part before the plane by its improved Projection, its part
// behind by rule P. Then the improved Projection of the former: every pixel that it touches is
// certified before the box. None for a box wholly behind the plane: rule P alone is for those.
// Where test_box says kFutile this hides no part of the box either.
std::optional<PlaneRect> improved_test(const OcclusionMap& map, const Box& local_box);

}  // namespace pvsfarm

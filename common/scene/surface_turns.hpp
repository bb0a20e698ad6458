// Fronts for triangles that block from both sides: so that neighbours agree, and solids look
// outwards.
#pragma once

#include "common/scene/surface_splits.hpp"

namespace pvsfarm {

// 1 for each sheet whose front sees its vertices counter-clockwise in descending order. One-sided
// sheets and borders of closed solids have the front they have; from them, and from the first of
// what is not reached, agreement spreads over edges with two triangles.
// `uses`: those of mesh.sheets, sorted.
std::vector<std::uint8_t> choose_fronts(const SheetMesh& mesh, const std::vector<EdgeUse>& uses);

}  // namespace pvsfarm

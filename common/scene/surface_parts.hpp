// The parts of a welded mesh that hang together by whole edges, and which of them are worth
// keeping.
#pragma once

#include "common/scene/surface_splits.hpp"

namespace pvsfarm {

struct SurfacePart {
  double area = 0;  // [square scene units]
  std::uint32_t sheets = 0;
  // Every edge has two triangles, and every fold bends away from the middle; by floating point,
  // so not a proof.
  bool is_convex = true;
};

struct SurfaceParts {
  std::vector<std::uint32_t> of_sheet;
  std::vector<SurfacePart> parts;  // by their first sheets
};

// `uses`: those of mesh.sheets, sorted.
SurfaceParts find_parts(const SheetMesh& mesh, const std::vector<EdgeUse>& uses);

}  // namespace pvsfarm

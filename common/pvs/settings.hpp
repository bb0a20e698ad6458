// What a bake is asked to do, beside scene and cells. Part of every identity: two bakes with the
// same scene, cells, settings and kernel give the same bytes.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/digest.hpp"

namespace pvsfarm {

enum class RasterKind : std::uint8_t { kDirect = 0, kOsmesa = 1 };

// How one cell is evaluated. None of it can make a result unsound, only looser or slower.
struct EvaluatorSettings {
  RasterKind raster = RasterKind::kDirect;
  int resolution_px = 256;    // [limit] 64 .. 1024; pixels a side of an occlusion map
  int planes_per_face = 6;    // [limit] 1 .. 16; at most so many projection planes a cell face
  double extent = 1.1;        // [limit] 0.25 .. 4; half a map's side / (cell half side + distance)
  double near_m = 0;          // matter nearer to the cell than this never occludes (theory 0.2)
  friend bool operator==(const EvaluatorSettings&, const EvaluatorSettings&) = default;
};

// When the coordinator splits a cell.
struct SubdivisionSettings {
  std::uint64_t budget_triangles = 0;  // split while a PVS holds more; 0: never split
  double min_cell_m = 1;               // a side shorter than twice this is not split
  friend bool operator==(const SubdivisionSettings&, const SubdivisionSettings&) = default;
};

struct BakeSettings {
  EvaluatorSettings evaluator;
  SubdivisionSettings subdivision;
  friend bool operator==(const BakeSettings&, const BakeSettings&) = default;
};

void add_to_digest(DigestBuilder& digest, const EvaluatorSettings& settings);
void add_to_digest(DigestBuilder& digest, const BakeSettings& settings);
const char* to_string(RasterKind kind);

}  // namespace pvsfarm

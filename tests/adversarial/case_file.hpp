// The cases of cases.json: tiny scenes, each built to defeat one plausible shortcut.
//
// Shape: an array of {"id", "note", "must", "cell": [x0,y0,z0,x1,y1,z1],
//   "plane_z": number | null, "occluders": [{"box": [6 numbers]} | {"poly": [[x,y,z], ...]
//   convex}], "occludee": [6 numbers], "witness": [[x,y,z],[x,y,z]] | null}.
// `must`: VISIBLE (the witness proves it), HIDDEN (a sound and useful evaluator finds it), EITHER
// (truly hidden, but a sound evaluator may miss it). `plane_z`: the projection plane, across z, on
// which the shortcut fails.
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "common/cells/cell.hpp"
#include "common/geometry/box.hpp"
#include "common/scene/scene_source.hpp"
#include "tests/support/exact_oracle.hpp"

namespace pvsfarm {

enum class Must { kVisible, kHidden, kEither };

struct CaseOccluder {
  std::optional<Box> box;
  std::vector<Vec3> polygon;  // if it is no box
};

struct VisibilityCase {
  std::string id, note;
  Must must = Must::kEither;
  Box cell, occludee;
  std::vector<CaseOccluder> occluders;
  std::optional<double> plane_z;
  std::optional<std::pair<Vec3, Vec3>> witness;
};

// What GoogleTest prints of a case.
inline void PrintTo(const VisibilityCase& c, std::ostream* out) { *out << c.id << ": " << c.note; }

// Reads tests/adversarial/cases.json; aborts if it is broken.
const std::vector<VisibilityCase>& all_cases();
std::vector<VisibilityCase> cases_that(Must must);

// The matter of a case as convex polygons; a box as its faces.
std::vector<std::vector<Vec3>> occluder_polygons(const VisibilityCase& c);
// The same, exactly.
std::vector<ExactPolygon> exact_matter(const VisibilityCase& c);

// A case set up somewhere: its scene, the position of the occludee in it, and its cell.
struct PlacedCase {
  SceneSource source;
  std::uint32_t occludee = 0;
  Cell cell;
};

// The case with its axes renamed, so that the line of sight runs along each of the six directions:
// placement 0 is the case as given. Exact.
inline constexpr int kPlacements = 6;
PlacedCase placed(const VisibilityCase& c, int placement);

// The case turned as a whole about all axes, the cell an oriented box. Rounded; objects keep or
// gain extent, so what is visible stays visible and what is hidden may become visible.
PlacedCase turned(const VisibilityCase& c);

}  // namespace pvsfarm

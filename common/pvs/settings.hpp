// What a bake is asked to do, beside scene and cells. Part of every identity: two bakes with the
// same scene, cells, settings and kernel give the same bytes.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/digest.hpp"
#include "common/pvs/method.hpp"

namespace pvsfarm {

inline constexpr std::uint32_t kMaxHintViewpoints = 4096;

enum class RasterKind : std::uint8_t { kDirect = 0, kOsmesa = 1 };

inline constexpr Methods kDefaultMethods{Method::kAimedRays,      Method::kProjection,
                                         Method::kFineProjection, Method::kImproved,
                                         Method::kSweep,          Method::kShafts};

// How one cell is evaluated. None of it can make a result unsound, only looser or slower.
struct EvaluatorSettings {
  RasterKind raster = RasterKind::kDirect;
  int resolution_px = 256;  // [limit] 64 .. 1024; pixels a side of an occlusion map
  int planes_per_face = 6;  // [limit] 1 .. 16; at most so many projection planes a cell face
  double extent = 1.3;      // [limit] 0.25 .. 4; half a map's side / (cell half side + distance)
  double near_m = 0;        // matter nearer to the cell than this never occludes (theory 0.2)
  Methods methods = kDefaultMethods;
  // The cascade stops when (|PVS| - |seen|) / |PVS|, in triangles, is at most this. [limit] 0 .. 1
  double gap = 0.1;
  std::uint64_t max_rays = 100'000;  // a cell, of all witness methods; 0: no witnesses
  // Nominal processor time a cell, after which no further method is begun; 0: no limit. Counted in
  // work at fixed prices, never with a clock: every machine stops at the same place.
  double time_ms = 0;
  int item_buffer_px = 128;  // [limit] 32 .. 1024; pixels a side of an item buffer
  // The cell's polygon budget: methods are escalated while the PVS exceeds it. 0: none.
  std::uint64_t budget_triangles = 0;
  // Viewpoints a cell that visibility hints are sampled from; 0: none. [limit] kMaxHintViewpoints
  // No part of a bake's identity: its store is the same with any number.
  std::uint32_t hint_viewpoints = 0;
  friend bool operator==(const EvaluatorSettings&, const EvaluatorSettings&) = default;
};

// When the coordinator splits a cell, and when it takes splits back (theory G).
struct SubdivisionSettings {
  std::uint64_t budget_triangles = 0;  // split while a PVS holds more; 0: never split
  double min_cell_m = 1;               // a side shorter than twice this is not split
  // A cell is not split if a single viewpoint already sees more than the budget, or all but this
  // part of the PVS: nothing is left to gain. [limit] 0 .. 1
  double split_gain = 0.1;
  // Sibling leaves become one if their union holds at most this part more triangles than each of
  // them. 0: only if they are equal; negative: never.
  double merge_tolerance = 0.02;
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

// What a worker says of one cell: monotone facts, so merging needs no order (ADR 1).
#pragma once

#include <cstdint>
#include <vector>

#include "common/base/ids.hpp"
#include "common/pvs/hints.hpp"
#include "common/pvs/method.hpp"
#include "common/pvs/rounds.hpp"
#include "common/pvs/visible_set.hpp"

namespace pvsfarm {

// What the evaluation of a cell did and cost. Never part of the result's identity.
struct CellStatistics {
  double cpu_ms = 0;
  std::uint32_t planes = 0;               // occlusion maps drawn
  std::uint32_t occluder_candidates = 0;  // legal for the cell, owned by the parent's PVS
  std::uint32_t projections = 0;          // pieces handed to the rasteriser
  std::uint32_t occluders_skipped = 0;    // already hidden behind others
  std::uint32_t box_tests = 0;            // occludee boxes against one plane
  // Objects proved hidden that a witness then showed: they stay visible. Not 0: a bug.
  std::uint32_t contradictions = 0;
  StatisticsByMethod methods{};
  std::vector<CascadeRound> rounds;  // in their order; their figures add up to the methods'
};

struct CellDelta {
  CellKey key;
  VisibleSet hidden;  // objects of the parent's PVS proved hidden from the cell
  // Objects of the cell's PVS that a witness proves seen from it: seen <= truth <= PVS. What is
  // neither hidden nor seen is open.
  VisibleSet seen;
  // Triangles of objects seen from one viewpoint, the most that was found (L_pt of theory G); 0
  // where nobody asked.
  std::uint64_t point_triangles = 0;
  CellStatistics statistics;
  HintBytes hints;  // of the cell's PVS, in its order (hints.hpp); empty: nobody asked
};

}  // namespace pvsfarm

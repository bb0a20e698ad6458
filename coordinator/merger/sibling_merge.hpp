// Splits that were not worth it are taken back: two sibling leaves whose sets hardly differ become
// one, so that subdivision never stores more than it saves.
//
// Two leaves (or what was merged before) become their parent if the union of their PVS has at most
// 1 + merge_tolerance times the triangles of the smallest PVS among all leaves that would be in it,
// measured on the leaves that were split off, so that tolerances do not add up over the levels; and
// unless the union exceeds a budget that every one of those leaves keeps. A cell that was given up
// merges with nothing.
//
// Sound: the union holds whatever either half may see, and the halves tile their parent. What a
// witness saw from the parent was seen from one of the halves.
// Threads: one.
#pragma once

#include <array>
#include <vector>

#include "common/pvs/delta.hpp"
#include "common/pvs/store_writer.hpp"
#include "coordinator/merger/round_figures.hpp"
#include "coordinator/tree/tree.hpp"

namespace pvsfarm {

// What evaluations did, summed over many cells.
struct MethodFigures {
  std::uint64_t hidden_objects = 0, seen_objects = 0, hidden_triangles = 0, seen_triangles = 0;
  std::uint64_t work = 0;
  double cpu_ms = 0;
};
struct CostFigures {
  double cpu_ms = 0;
  std::uint64_t contradictions = 0;  // objects a certificate hid and a witness saw
  std::array<MethodFigures, kMethodCount> methods;
  RoundSums rounds;
  void add(const CellStatistics& statistics);
  void add(const CostFigures& other);
};

// A node of one root's subtree on its way to the store. Its sets are kept in canonical bytes: a
// whole subtree is in memory.
struct SubtreeNode {
  StoreNode node;  // but for its sets
  std::vector<std::byte> visible, seen;
  HintBytes hints;            // of `visible`; empty: unknown
  CostFigures cost;           // with that of the nodes merged into it
  std::uint32_t parts = 0;    // nodes merged into it
  std::uint32_t refuted = 0;  // objects that it saw, but both its halves hold for hidden: a bug
};

// `subtree`: all nodes of one root, in canonical order. Nodes merged into others are removed.
void merge_siblings(const Tree& tree, std::vector<SubtreeNode>& subtree);

}  // namespace pvsfarm

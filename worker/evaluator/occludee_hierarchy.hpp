// Tests the scene's hierarchy of occludee boxes against a set of occlusion maps.
//
// Source: Durand 2000, 4.2; theory A.3 (Rules P and S), A.9 (futility).
#pragma once

#include <bitset>
#include <span>

#include "common/pvs/visible_set.hpp"
#include "common/scene/scene.hpp"
#include "worker/visibility/occludee_test.hpp"

namespace pvsfarm {

inline constexpr int kMaxMaps = 96;  // six faces, sixteen planes each
using MapMask = std::bitset<kMaxMaps>;

struct HierarchyTest {
  const Scene& scene;
  const CellFrame& frame;
  std::span<const OcclusionMap> maps;
  int splits = 0;  // Rule S: an object's box is halved at most so many times in a row
  std::uint32_t box_tests = 0;

  // Removes from `open` every object proved hidden.
  void run(VisibleSet& open);

 private:
  bool hidden(const Box& local_box, MapMask& useful);
  bool hidden_by_parts(const Box& local_box, MapMask useful, int splits_left);
  void visit(std::uint32_t node, MapMask useful, VisibleSet& open);
};

}  // namespace pvsfarm

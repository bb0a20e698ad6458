// A hierarchy over a scene's occluders, for finding those near a plane that are not hidden yet.
//
// Source: Durand 2000, 6.1 (preselection of occluders by a hierarchy).
// Shape: blocks of eight boxes, for eight lanes. Occluders stand in Morton order of their boxes'
// middles; a level's blocks are the boxes of the next. 26 bytes an occluder.
// Threads: const after construction; share freely.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/scene/scene.hpp"

namespace pvsfarm {

class OccluderTree {
 public:
  static constexpr int kWidth = 8;
  struct Block {
    float lo[3][kWidth], hi[3][kWidth];  // world, outwards; lo > hi: no box
  };

  // All occluders but faces of solids, which their solids stand for.
  explicit OccluderTree(const Scene& scene);

  // Level 0 holds the boxes of the occluders; the last one is a single block, or there is none.
  // Box k of block b belongs to occluder order()[8 b + k], or to block 8 b + k of the level before.
  int level_count() const { return static_cast<int>(levels_.size()); }
  std::span<const Block> level(int i) const { return levels_[i]; }
  std::span<const std::uint32_t> order() const { return order_; }

 private:
  std::vector<std::vector<Block>> levels_;
  std::vector<std::uint32_t> order_;
};

}  // namespace pvsfarm

// The solids among the scene's surfaces: triangles whose edges cancel, so that they part space into
// an inside and an outside, however they fold, nest or pass through themselves.
//
// Source: theory A.12; docs/algorithm.md A.12.
// Differs from Durand 2000: what dangles from a solid (a fin, a loose sheet) is taken away instead
// of costing the solid, and a border that no segment from a cell to an object comes near is none.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/scene/scene.hpp"

namespace pvsfarm {

// Triangles next to each other.
struct SliceBlock {
  Box box;                             // world
  std::uint32_t first = 0, count = 0;  // into SliceSolids::triangles()
};

struct SliceSolid {
  Box box;  // world
  std::uint32_t first_block = 0, block_count = 0;
  bool two_sided = true;  // every triangle blocks from both sides
  // Where its border lies, if it has one: at or below the ground, at the sides of all occludees.
  bool on_ground = false, at_sides = false;
  bool closed() const { return !on_ground && !at_sides; }
};

struct SliceTriangle {
  std::uint32_t index;  // into Scene::surface_triangles()
  std::int32_t turn;    // 1 as it is there, -1 seen from behind, so that neighbours agree
};

enum class SolidRule {
  kClosed,  // no border
  // Nothing at or below the ground counts, and border may lie there and at the sides of
  // occludee_bounds().
  kStanding,
};

// Threads: const after construction.
class SliceSolids {
 public:
  SliceSolids(const Scene& scene, SolidRule rule);

  const std::vector<SliceSolid>& solids() const { return solids_; }
  std::span<const SliceBlock> blocks(const SliceSolid& solid) const {
    return std::span(blocks_).subspan(solid.first_block, solid.block_count);
  }
  std::span<const SliceTriangle> triangles(const SliceBlock& block) const {
    return std::span(triangles_).subspan(block.first, block.count);
  }

 private:
  std::vector<SliceSolid> solids_;
  std::vector<SliceBlock> blocks_;
  std::vector<SliceTriangle> triangles_;
};

// Around the boxes of all occludees.
Box occludee_bounds(const Scene& scene);

}  // namespace pvsfarm

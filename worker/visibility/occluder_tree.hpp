// A hierarchy of boxes over a scene's occluders, for who asks for those in a slab of space: a sweep
// needs all leaves near a plane, not the largest occluders of the scene.
//
// Threads: const after construction.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/scene/scene.hpp"

namespace pvsfarm {

class OccluderTree {
 public:
  struct Node {
    float lo[3], hi[3];       // world, outwards
    std::uint32_t first = 0;  // into order(), for a leaf; else its children are first and first + 1
    std::uint32_t count = 0;  // 0: not a leaf
    Box box() const { return {{lo[0], lo[1], lo[2]}, {hi[0], hi[1], hi[2]}}; }
  };

  // All occluders but faces of solids, which their solids stand for.
  explicit OccluderTree(const Scene& scene);

  std::span<const Node> nodes() const { return nodes_; }  // 0 is the root; none: no occluders
  // Occluder indices, leaf by leaf.
  std::span<const std::uint32_t> order() const { return order_; }

 private:
  void split(const Scene& scene, std::uint32_t node, std::uint32_t first, std::uint32_t count);

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
};

}  // namespace pvsfarm

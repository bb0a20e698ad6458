// A hierarchy of boxes over triangles, four children a node, for queries in double precision.
//
// Boxes are floats relative to origin(), rounded outwards; triangles are held by number, so a scene
// of 8 million triangles takes about 100 MB. Built top down by the surface area heuristic in bins
// (Wald 2007), O(n log n); the same triangles always give the same tree.
// Threads: const after construction.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/vec.hpp"
#include "common/scene/scene.hpp"

namespace pvsfarm {

class TriangleTree {
 public:
  // Child k lies in plane[0][axis][k] .. plane[1][axis][k]. A leaf has count[k] > 0 and holds
  // order()[child[k]] and those after it; an absent child has an empty box, which nothing meets.
  struct alignas(64) Node {
    float plane[2][3][4];
    std::uint32_t child[4];
    std::uint8_t count[4];
  };
  // [limit] A depth-first walk that holds three siblings a level fits a stack of this many.
  static constexpr int kMaxStack = 256;

  // `chosen`: numbers of triangles in scene.all_triangles().
  TriangleTree(const Scene& scene, std::vector<std::uint32_t> chosen, const Vec3& origin);

  bool empty() const { return order_.empty(); }
  const Vec3& origin() const { return origin_; }
  std::span<const Node> nodes() const { return nodes_; }  // node 0 is the root
  std::span<const std::uint32_t> order() const { return order_; }

 private:
  Vec3 origin_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
};

}  // namespace pvsfarm

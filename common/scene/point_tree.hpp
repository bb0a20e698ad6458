// Points in a tree of boxes, to find those near a segment.
#pragma once

#include <cstdint>
#include <vector>

#include "common/geometry/box.hpp"

namespace pvsfarm {

class PointTree {
 public:
  // `members`: indices into `positions`, which must outlive the tree.
  PointTree(const std::vector<Vec3>& positions, std::vector<std::uint32_t> members);

  // fn(index) for every member within `room` of the segment, and for some that are not. With no
  // room: for every member exactly on it.
  template <class Fn>
  void for_each_near_segment(const Vec3& a, const Vec3& b, double room, Fn&& fn) const {
    if (nodes_.empty()) return;
    const Segment segment(a, b, room, slack_);
    std::uint32_t stack[kMaxDepth + 1];
    int depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
      const Node& node = nodes_[stack[--depth]];
      if (!segment.may_meet(node.box)) continue;
      if (node.child == 0) {
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
          if (segment.box.contains(positions_[members_[i]])) fn(members_[i]);
      } else {
        stack[depth++] = node.child;
        stack[depth++] = node.child + 1;
      }
    }
  }

 private:
  static constexpr int kMaxDepth = 40;  // halves of at most 2^32 members
  struct Node {
    Box box;
    std::uint32_t first = 0, count = 0;  // into members_
    std::uint32_t child = 0;             // two at `child`; 0: a leaf
  };
  // Separating axes of segment and box, with room for rounding.
  struct Segment {
    Segment(const Vec3& a, const Vec3& b, double room, double slack);
    bool may_meet(const Box& other) const;
    Box box;
    Vec3 middle, half;  // half: from the middle to `b`
    double room;
  };

  const std::vector<Vec3>& positions_;
  std::vector<std::uint32_t> members_;
  std::vector<Node> nodes_;
  double slack_ = 0;
};

}  // namespace pvsfarm

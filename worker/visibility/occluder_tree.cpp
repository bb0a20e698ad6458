#include "worker/visibility/occluder_tree.hpp"

#include <algorithm>
#include <limits>

#include "common/geometry/rounding.hpp"

namespace pvsfarm {
namespace {

constexpr std::uint32_t kLeafSize = 8;

}  // namespace

OccluderTree::OccluderTree(const Scene& scene) {
  const auto occluders = scene.occluders();
  for (std::uint32_t i = 0; i < occluders.size(); ++i)
    if (occluders[i].face_of < 0 && occluders[i].point_count >= 3) order_.push_back(i);
  if (order_.empty()) return;
  nodes_.reserve(order_.size() / 2 + 1);
  nodes_.emplace_back();
  split(scene, 0, 0, static_cast<std::uint32_t>(order_.size()));
}

// Halves the longest side of the centres' box by number.
void OccluderTree::split(const Scene& scene, std::uint32_t index, std::uint32_t first,
                         std::uint32_t count) {
  const auto occluders = scene.occluders();
  Box box, centers;
  for (std::uint32_t i = first; i < first + count; ++i) {
    const Box& own = occluders[order_[i]].box;
    box.add(own);
    centers.add(own.center());
  }
  for (int a = 0; a < 3; ++a) {
    nodes_[index].lo[a] = float_not_above(box.lo[a]);
    nodes_[index].hi[a] = float_not_below(box.hi[a]);
  }
  if (count <= kLeafSize) {
    nodes_[index].first = first;
    nodes_[index].count = count;
    return;
  }
  int axis = 0;
  const Vec3 size = centers.size();
  for (int a = 1; a < 3; ++a)
    if (size[a] > size[axis]) axis = a;
  const std::uint32_t half = count / 2;
  const auto begin = order_.begin() + first;
  std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t a, std::uint32_t b) {
    const double ca = occluders[a].box.lo[axis] + occluders[a].box.hi[axis];
    const double cb = occluders[b].box.lo[axis] + occluders[b].box.hi[axis];
    return ca < cb || (ca == cb && a < b);
  });
  const auto child = static_cast<std::uint32_t>(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  nodes_[index].first = child;
  split(scene, child, first, half);
  split(scene, child + 1, first + half, count - half);
}

}  // namespace pvsfarm

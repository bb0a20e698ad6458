#include "common/scene/hierarchy.hpp"

#include <algorithm>
#include <bit>
#include <numeric>

namespace pvsfarm {
namespace {

// The first id of the upper half of [first, first + count).
std::uint32_t split_position(std::span<const std::uint64_t> morton, std::uint32_t first,
                             std::uint32_t count) {
  const std::uint64_t low = morton[first], high = morton[first + count - 1];
  if (low == high) return first + count / 2;
  const std::uint64_t bit = std::bit_floor(low ^ high);
  const std::uint64_t threshold = high & ~(bit - 1);  // the common prefix, then a one
  const auto begin = morton.begin() + first;
  return first +
         static_cast<std::uint32_t>(std::lower_bound(begin, begin + count, threshold) - begin);
}

}  // namespace

ObjectOrder morton_order(std::span<const Box> boxes) {
  Box cube;
  for (const Box& box : boxes) cube.add(box.center());
  const Vec3 size = cube.size();
  cube.hi = cube.lo + Vec3(std::max({size.x, size.y, size.z}));

  std::vector<std::uint64_t> codes;
  codes.reserve(boxes.size());
  for (const Box& box : boxes) codes.push_back(morton_code(box.center(), cube));

  ObjectOrder order;
  order.file_index.resize(boxes.size());
  std::iota(order.file_index.begin(), order.file_index.end(), 0u);
  std::stable_sort(order.file_index.begin(), order.file_index.end(),
                   [&codes](std::uint32_t a, std::uint32_t b) { return codes[a] < codes[b]; });
  for (const std::uint32_t i : order.file_index) order.morton.push_back(codes[i]);
  return order;
}

std::vector<BvhNode> build_bvh(std::span<const ObjectRecord> objects,
                               std::span<const std::uint64_t> morton) {
  std::vector<BvhNode> nodes(1);
  nodes[0].count = static_cast<std::uint32_t>(objects.size());
  // Breadth first: a node's children are appended when it is reached.
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const BvhNode node = nodes[i];
    if (node.count <= kLeafObjects) continue;
    const std::uint32_t middle = split_position(morton, node.first, node.count);
    nodes[i].child = static_cast<std::uint32_t>(nodes.size());
    BvhNode low, high;
    low.first = node.first;
    low.count = middle - node.first;
    high.first = middle;
    high.count = node.count - low.count;
    nodes.push_back(low);
    nodes.push_back(high);
  }
  for (std::size_t i = nodes.size(); i-- > 0;) {
    BvhNode& node = nodes[i];
    if (node.child != 0) {
      node.box = nodes[node.child].box;
      node.box.add(nodes[node.child + 1].box);
      continue;
    }
    for (const ObjectRecord& o : objects.subspan(node.first, node.count))
      if (o.occludee) node.box.add(o.box);
  }
  return nodes;
}

}  // namespace pvsfarm

#include "common/scene/point_tree.hpp"

#include <algorithm>
#include <cmath>

namespace pvsfarm {
namespace {
constexpr std::uint32_t kLeafSize = 8;
constexpr double kRounding = 0x1p-45;  // of the largest coordinate: hundreds of roundings
}  // namespace

PointTree::PointTree(const std::vector<Vec3>& positions, std::vector<std::uint32_t> members)
    : positions_(positions), members_(std::move(members)) {
  if (members_.empty()) return;
  nodes_.push_back({{}, 0, static_cast<std::uint32_t>(members_.size()), 0});
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    Node node = nodes_[n];
    const auto first = members_.begin() + node.first, last = first + node.count;
    for (auto m = first; m != last; ++m) node.box.add(positions_[*m]);
    if (node.count > kLeafSize) {
      const Vec3 size = node.box.size();
      const int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
      const std::uint32_t half = node.count / 2;
      std::nth_element(first, first + half, last, [&](std::uint32_t p, std::uint32_t q) {
        return positions_[p][axis] != positions_[q][axis]
                   ? positions_[p][axis] < positions_[q][axis]
                   : p < q;
      });
      node.child = static_cast<std::uint32_t>(nodes_.size());
      nodes_.push_back({{}, node.first, half, 0});
      nodes_.push_back({{}, node.first + half, node.count - half, 0});
    }
    nodes_[n] = node;
  }
  double largest = 0;
  for (int a = 0; a < 3; ++a)
    largest = std::max({largest, std::abs(nodes_[0].box.lo[a]), std::abs(nodes_[0].box.hi[a])});
  slack_ = kRounding * largest;
}

PointTree::Segment::Segment(const Vec3& a, const Vec3& b, double room_about, double slack)
    : middle((a + b) * 0.5), half((b - a) * 0.5), room(room_about + slack) {
  box.add(a);
  box.add(b);
  box.lo -= Vec3(room_about);
  box.hi += Vec3(room_about);
}

bool PointTree::Segment::may_meet(const Box& other) const {
  if (!box.meets(other)) return false;
  const Vec3 extent = other.size() * 0.5 + Vec3(room), offset = other.center() - middle;
  const auto overlaps = [&](int u, int v) {
    const double reach = extent[u] * std::abs(half[v]) + extent[v] * std::abs(half[u]);
    return std::abs(offset[u] * half[v] - offset[v] * half[u]) <= reach * (1 + 0x1p-40);
  };
  return overlaps(0, 1) && overlaps(1, 2) && overlaps(2, 0);
}

}  // namespace pvsfarm

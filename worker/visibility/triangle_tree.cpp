#include "worker/visibility/triangle_tree.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "common/base/check.hpp"
#include "common/geometry/rounding.hpp"

namespace pvsfarm {
namespace {

constexpr std::uint32_t kLeafTriangles = 4;
constexpr int kBins = 12;
// Where to cut a large range is asked of so many of its triangles: as good a tree of 8 million in
// half the time.
constexpr std::uint32_t kSample = 1024;
// [limit] Below this depth ranges are cut in the middle, which ends after at most 16 more levels.
constexpr int kMaxHeuristicDepth = 60;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct FloatBox {
  float lo[3] = {kInfinity, kInfinity, kInfinity};
  float hi[3] = {-kInfinity, -kInfinity, -kInfinity};

  void add(const FloatBox& b) {
    for (int a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], b.lo[a]);
      hi[a] = std::max(hi[a], b.hi[a]);
    }
  }
  float center(int a) const { return 0.5f * lo[a] + 0.5f * hi[a]; }
  // Half the surface area; 0 for an empty box.
  float area() const {
    if (!(lo[0] <= hi[0])) return 0;
    const float x = hi[0] - lo[0], y = hi[1] - lo[1], z = hi[2] - lo[2];
    return x * y + y * z + z * x;
  }
};

struct Part {
  FloatBox box;
  std::uint32_t triangle;
};

struct Range {
  std::uint32_t first, count;
  FloatBox box;
};

FloatBox box_of(const Scene& scene, const Triangle& triangle, const Vec3& origin) {
  FloatBox box;
  for (int a = 0; a < 3; ++a) {
    double lo = scene.vertices()[triangle.vertex[0]][a], hi = lo;
    for (int k = 1; k < 3; ++k) {
      const double v = scene.vertices()[triangle.vertex[k]][a];
      lo = std::min(lo, v), hi = std::max(hi, v);
    }
    box.lo[a] = float_not_above(lo - origin[a]);
    box.hi[a] = float_not_below(hi - origin[a]);
  }
  return box;
}

Range range_of(const std::vector<Part>& parts, std::uint32_t first, std::uint32_t count) {
  Range range{first, count, {}};
  for (std::uint32_t i = first; i < first + count; ++i) range.box.add(parts[i].box);
  return range;
}

// A cut of the centres along an axis: bin < `bin` is left.
struct Cut {
  int axis = -1, bin = 0;
  float lo = 0, scale = 0;
  int bin_of(const FloatBox& box) const {
    const float at = (box.center(axis) - lo) * scale;
    return at < kBins - 1 ? static_cast<int>(std::max(at, 0.0f)) : kBins - 1;
  }
};

Cut best_cut(const std::vector<Part>& parts, const Range& range) {
  const std::uint32_t end = range.first + range.count, step = 1 + (range.count - 1) / kSample;
  const std::uint32_t sampled = 1 + (range.count - 1) / step;
  FloatBox centers;
  for (std::uint32_t i = range.first; i < end; i += step) {
    const FloatBox& b = parts[i].box;
    const float c[3] = {b.center(0), b.center(1), b.center(2)};
    centers.add(FloatBox{{c[0], c[1], c[2]}, {c[0], c[1], c[2]}});
  }
  Cut best;
  float least = kInfinity;
  for (int axis = 0; axis < 3; ++axis) {
    const float extent = centers.hi[axis] - centers.lo[axis];
    Cut cut{axis, 0, centers.lo[axis], kBins / extent};
    if (!(extent > 0) || !(cut.scale < kInfinity)) continue;
    std::array<FloatBox, kBins> boxes;
    std::array<std::uint32_t, kBins> counts{};
    for (std::uint32_t i = range.first; i < end; i += step) {
      const int bin = cut.bin_of(parts[i].box);
      boxes[bin].add(parts[i].box);
      ++counts[bin];
    }
    std::array<float, kBins> right_cost{};
    FloatBox box;
    std::uint32_t count = 0;
    for (int b = kBins - 1; b > 0; --b) {
      box.add(boxes[b]);
      count += counts[b];
      right_cost[b] = box.area() * static_cast<float>(count);
    }
    box = {};
    count = 0;
    for (int b = 1; b < kBins; ++b) {
      box.add(boxes[b - 1]);
      count += counts[b - 1];
      if (count == 0 || count == sampled) continue;
      const float cost = box.area() * static_cast<float>(count) + right_cost[b];
      if (cost < least) least = cost, best = cut, best.bin = b;
    }
  }
  return best;
}

std::array<Range, 2> split(std::vector<Part>& parts, const Range& range, int depth) {
  const Cut cut = depth < kMaxHeuristicDepth ? best_cut(parts, range) : Cut{};
  std::uint32_t left = range.count / 2;
  if (cut.axis >= 0) {
    const auto begin = parts.begin() + range.first;
    const auto middle = std::partition(begin, begin + range.count, [&](const Part& part) {
      return cut.bin_of(part.box) < cut.bin;
    });
    left = static_cast<std::uint32_t>(middle - begin);
  }
  return {range_of(parts, range.first, left),
          range_of(parts, range.first + left, range.count - left)};
}

// Up to four children: the one of the largest area is split until there are four.
int children_of(std::vector<Part>& parts, const Range& range, int depth,
                std::array<Range, 4>& children) {
  int count = 1;
  children[0] = range;
  while (count < 4) {
    int pick = -1;
    for (int k = 0; k < count; ++k) {
      if (children[k].count <= kLeafTriangles) continue;
      if (pick < 0 || children[k].box.area() > children[pick].box.area()) pick = k;
    }
    if (pick < 0) break;
    const auto halves = split(parts, children[pick], depth);
    children[pick] = halves[0];
    children[count++] = halves[1];
  }
  return count;
}

}  // namespace

TriangleTree::TriangleTree(const Scene& scene, std::vector<std::uint32_t> chosen,
                           const Vec3& origin)
    : origin_(origin), order_(std::move(chosen)) {
  std::vector<Part> parts;
  parts.reserve(order_.size());
  for (const std::uint32_t t : order_)
    parts.push_back({box_of(scene, scene.all_triangles()[t], origin), t});
  struct Open {
    std::uint32_t node;
    int depth;
    Range range;
  };
  if (parts.empty()) return;
  nodes_.emplace_back();
  std::vector<Open> open{{0, 0, range_of(parts, 0, static_cast<std::uint32_t>(parts.size()))}};
  while (!open.empty()) {
    const Open now = open.back();
    open.pop_back();
    PVS_CHECK_LT(3 * (now.depth + 2), kMaxStack);
    std::array<Range, 4> children;
    const int count = children_of(parts, now.range, now.depth, children);
    for (int k = 0; k < 4; ++k) {
      const Range child = k < count ? children[k] : Range{};
      for (int a = 0; a < 3; ++a) {
        nodes_[now.node].plane[0][a][k] = child.box.lo[a];
        nodes_[now.node].plane[1][a][k] = child.box.hi[a];
      }
      const bool leaf = child.count <= kLeafTriangles;
      nodes_[now.node].count[k] = leaf ? static_cast<std::uint8_t>(child.count) : 0;
      nodes_[now.node].child[k] = leaf ? child.first : static_cast<std::uint32_t>(nodes_.size());
      if (leaf) continue;
      open.push_back({nodes_[now.node].child[k], now.depth + 1, child});
      nodes_.emplace_back();
    }
  }
  for (std::size_t i = 0; i < parts.size(); ++i) order_[i] = parts[i].triangle;
}

}  // namespace pvsfarm

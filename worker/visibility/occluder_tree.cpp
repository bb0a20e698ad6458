#include "worker/visibility/occluder_tree.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "common/geometry/rounding.hpp"

namespace pvsfarm {
namespace {

using Block = OccluderTree::Block;
constexpr std::size_t kWidth = OccluderTree::kWidth;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Blocks of `count` boxes; box(i, lo, hi) tells one.
template <class TellBox>
std::vector<Block> blocks_of(std::size_t count, TellBox&& box) {
  std::vector<Block> blocks((count + kWidth - 1) / kWidth);
  for (std::size_t i = 0; i < blocks.size() * kWidth; ++i) {
    float lo[3] = {kInfinity, kInfinity, kInfinity}, hi[3] = {-kInfinity, -kInfinity, -kInfinity};
    if (i < count) box(i, lo, hi);
    for (int a = 0; a < 3; ++a) {
      blocks[i / kWidth].lo[a][i % kWidth] = lo[a];
      blocks[i / kWidth].hi[a][i % kWidth] = hi[a];
    }
  }
  return blocks;
}

// By their upper halves, byte by byte; equal ones stay in order.
void sort_by_upper_half(std::vector<std::uint64_t>& codes) {
  std::vector<std::uint64_t> sorted(codes.size());
  for (int shift = 32; shift < 64; shift += 8) {
    std::array<std::size_t, 257> first{};
    for (const std::uint64_t code : codes) ++first[(code >> shift & 255) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    for (const std::uint64_t code : codes) sorted[first[code >> shift & 255]++] = code;
    codes.swap(sorted);
  }
}

// By the leading 32 of the code's 63 bits: cells of a thousandth of the scene an axis.
std::vector<std::uint32_t> by_morton_code(const Scene& scene) {
  const auto occluders = scene.occluders();
  std::vector<std::uint64_t> codes;
  codes.reserve(occluders.size());
  for (std::uint32_t i = 0; i < occluders.size(); ++i)
    if (occluders[i].face_of < 0 && occluders[i].point_count >= 3)
      codes.push_back(morton_code(occluders[i].box.center(), scene.bounds()) >> 31 << 32 | i);
  sort_by_upper_half(codes);
  std::vector<std::uint32_t> order(codes.size());
  for (std::size_t i = 0; i < codes.size(); ++i) order[i] = static_cast<std::uint32_t>(codes[i]);
  return order;
}

}  // namespace

OccluderTree::OccluderTree(const Scene& scene) : order_(by_morton_code(scene)) {
  if (order_.empty()) return;
  levels_.push_back(blocks_of(order_.size(), [&](std::size_t i, float* lo, float* hi) {
    const Box& box = scene.occluders()[order_[i]].box;
    for (int a = 0; a < 3; ++a) {
      lo[a] = float_not_above(box.lo[a]);
      hi[a] = float_not_below(box.hi[a]);
    }
  }));
  while (levels_.back().size() > 1) {
    const std::vector<Block>& below = levels_.back();
    levels_.push_back(blocks_of(below.size(), [&](std::size_t i, float* lo, float* hi) {
      for (int a = 0; a < 3; ++a) {
        lo[a] = *std::min_element(below[i].lo[a], below[i].lo[a] + kWidth);
        hi[a] = *std::max_element(below[i].hi[a], below[i].hi[a] + kWidth);
      }
    }));
  }
}

}  // namespace pvsfarm

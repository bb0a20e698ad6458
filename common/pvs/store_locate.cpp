#include "common/pvs/store_locate.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/geometry/rounding.hpp"
#include "common/pvs/pvs_format.h"

namespace pvsfarm {

void LocateBuilder::add(const Cell& root, std::uint32_t node) {
  const Box box = root.bounds();
  const bool aligned = root.origin == Vec3(0) && root.axes == Cell{}.axes;
  Root made{{}, node};
  // The reader takes points within 2^-46 of a turned cell's coordinates for inside: hold them too.
  double margin = 0;
  if (!aligned)
    for (int a = 0; a < 3; ++a)
      margin = std::max({margin, std::abs(box.lo[a]), std::abs(box.hi[a]), std::abs(root.origin[a]),
                         std::abs(root.lo[a]), std::abs(root.hi[a])});
  margin *= 0x1p-44;
  for (int a = 0; a < 3; ++a) {
    made.box.lo[a] = float_not_above(box.lo[a] - margin);
    made.box.hi[a] = float_not_below(box.hi[a] + margin);
  }
  roots_.push_back(made);
}

std::vector<std::uint32_t> LocateBuilder::morton_order() const {
  const auto box_of = [](const Root& root) {
    const FloatBox& b = root.box;
    return Box{{b.lo[0], b.lo[1], b.lo[2]}, {b.hi[0], b.hi[1], b.hi[2]}};
  };
  Box bounds;
  for (const Root& root : roots_) bounds.add(box_of(root));
  std::vector<std::pair<std::uint64_t, std::uint32_t>> coded;
  for (std::uint32_t i = 0; i < roots_.size(); ++i)
    coded.emplace_back(morton_code(box_of(roots_[i]).center(), bounds), i);
  std::sort(coded.begin(), coded.end());
  std::vector<std::uint32_t> order;
  for (const auto& [code, i] : coded) order.push_back(i);
  return order;
}

std::vector<LocateBuilder::FloatBox> LocateBuilder::level_above(
    const std::vector<FloatBox>& level) {
  std::vector<FloatBox> above;
  for (std::size_t i = 0; i < level.size(); ++i) {
    if (i % PVS_LOCATE_FANOUT == 0) above.push_back(level[i]);
    for (int a = 0; a < 3; ++a) {
      above.back().lo[a] = std::min(above.back().lo[a], level[i].lo[a]);
      above.back().hi[a] = std::max(above.back().hi[a], level[i].hi[a]);
    }
  }
  return above;
}

void LocateBuilder::put(ByteWriter& out, const std::vector<FloatBox>& level) {
  for (const FloatBox& box : level) {
    for (const float v : box.lo) out.put_f32(v);
    for (const float v : box.hi) out.put_f32(v);
  }
}

ByteWriter LocateBuilder::take() const {
  ByteWriter out;
  out.put_u32(static_cast<std::uint32_t>(roots_.size()));
  out.put_u32(0);
  std::vector<FloatBox> level;
  for (const std::uint32_t i : morton_order()) {
    out.put_u32(roots_[i].node);
    level.push_back(roots_[i].box);
  }
  out.pad();
  // The boxes of single roots are in their nodes.
  while (!level.empty()) {
    put(out, level = level_above(level));
    if (level.size() == 1) break;
  }
  return out;
}

}  // namespace pvsfarm

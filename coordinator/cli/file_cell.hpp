// Cells and boxes in the scene file's own coordinates, as exports and queries give them.
#pragma once

#include <array>

#include "common/cells/cell.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm {

struct FileCell {
  Vec3 center;
  std::array<Vec3, 3> axes;
  Vec3 half;
};

// An axis-aligned cell has the coordinate axes in the file's frame too.
inline FileCell file_cell(UpAxis up, const Cell& cell) {
  const Vec3 half = cell.half();
  if (up == UpAxis::kZ) return {cell.center(), cell.axes, half};
  const auto turned = [](const Vec3& v) { return file_from_internal(UpAxis::kY, v); };
  // z becomes y, and y becomes -z: an axis may point either way, since the box is symmetric.
  // Adding 0 makes -0 a plain 0.
  return {turned(cell.center()) + 0.0,
          {turned(cell.axes[0]) + 0.0, turned(cell.axes[2]) + 0.0, -turned(cell.axes[1]) + 0.0},
          {half.x, half.z, half.y}};
}

inline Box file_box(UpAxis up, const Box& box) {
  Box turned;
  turned.add(file_from_internal(up, box.lo));
  turned.add(file_from_internal(up, box.hi));
  return turned;
}

}  // namespace pvsfarm

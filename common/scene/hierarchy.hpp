// The order of the objects and the hierarchy of their boxes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/scene/scene.hpp"

namespace pvsfarm {

// [limit] objects in a leaf of the hierarchy.
inline constexpr std::uint32_t kLeafObjects = 4;

struct ObjectOrder {
  std::vector<std::uint32_t> file_index;  // by object id
  std::vector<std::uint64_t> morton;      // by object id, ascending
};

// Objects along the Morton curve of their boxes' centres, in a cube so that a step is as long in
// z as it is in x; ties in file order. Neighbours in space become neighbours in id, which is what
// makes visible sets compress.
ObjectOrder morton_order(std::span<const Box> boxes_in_file_order);

// A binary tree over id ranges, cut where the highest bit of the Morton codes changes, in the
// middle where all are equal. `morton` is parallel to `objects`.
std::vector<BvhNode> build_bvh(std::span<const ObjectRecord> objects,
                               std::span<const std::uint64_t> morton);

}  // namespace pvsfarm

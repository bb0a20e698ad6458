// What the tests of generated scenes ask of them: which boxes there are, and which overlap.
#pragma once

#include <algorithm>
#include <string_view>
#include <vector>

#include "common/geometry/box.hpp"
#include "coordinator/generate/generated_scene.hpp"

namespace pvsfarm {

inline Box box_of(const SourceObject& object) {
  Box box;
  for (const Vec3& v : object.vertices) box.add(v);
  return box;
}

inline bool is_a(const SourceObject& object, std::string_view kind) {
  return object.name.starts_with(kind) && object.name[kind.size()] == '_';
}

inline std::vector<Box> boxes_of(const GeneratedScene& scene, std::string_view kind) {
  std::vector<Box> boxes;
  for (const SourceObject& object : scene.source.objects)
    if (is_a(object, kind)) boxes.push_back(box_of(object));
  return boxes;
}

inline bool overlap(const Box& a, const Box& b) {  // share more than a border
  for (int axis = 0; axis < 3; ++axis)
    if (!(a.lo[axis] < b.hi[axis] && b.lo[axis] < a.hi[axis])) return false;
  return true;
}

// Pairs of `boxes` and `others` that overlap; the boxes are swept along x.
inline std::size_t overlaps(std::vector<Box> boxes, std::vector<Box> others) {
  const auto by_x = [](const Box& a, const Box& b) { return a.lo.x < b.lo.x; };
  std::sort(boxes.begin(), boxes.end(), by_x);
  std::sort(others.begin(), others.end(), by_x);
  double widest = 0;
  for (const Box& box : others) widest = std::max(widest, box.size().x);
  std::size_t count = 0;
  for (const Box& box : boxes) {
    const Box from{{box.lo.x - widest, 0, 0}, {0, 0, 0}};
    for (auto at = std::lower_bound(others.begin(), others.end(), from, by_x);
         at != others.end() && at->lo.x < box.hi.x; ++at)
      count += overlap(box, *at);
  }
  return count;
}

inline std::vector<Box> cell_boxes(const GeneratedScene& scene) {
  std::vector<Box> boxes;
  for (const RootCell& root : scene.cells) boxes.push_back({root.cell.lo, root.cell.hi});
  return boxes;
}

}  // namespace pvsfarm

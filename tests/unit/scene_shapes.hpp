// Small shapes for the tests of scenes.
#pragma once

#include <string>

#include "common/geometry/box.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm {

// A closed box of twelve triangles, counter-clockwise seen from outside.
inline SourceObject box_object(std::string name, const Box& box) {
  SourceObject object;
  object.name = std::move(name);
  for (int k = 0; k < 8; ++k) object.vertices.push_back(box.corner(k));
  object.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return object;
}

}  // namespace pvsfarm

// Closed meshes of many triangles for tests, which importing does not take for convex solids.
#pragma once

#include <string>
#include <vector>

#include "common/geometry/box.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm {

// A grid of n x n squares whose corners are mapped by `point`, (i, j) from 0 to n; seen from where
// (d/di x d/dj) points. `closes`: corners n are corners 0.
template <class Point>
void add_sheet(SourceObject& object, int n, Point point, bool closes = false);

enum Sides {
  kLowX = 1,
  kHighX = 2,
  kLowY = 4,
  kHighY = 8,
  kLowZ = 16,
  kHighZ = 32,
  kAllSides = 63
};

// A box whose sides are cut into n x n squares, outward; only the sides named.
SourceObject fine_box(const Box& box, int n = 6, int sides = kAllSides);

// Around the axis through (x, 0, 0) along x, with n points around either way.
SourceObject torus(double x, double radius, double thickness, int n = 24);

// From x0 to x1 along x, over a closed line in y and z, its ends fanned over from the axis: closed,
// however the line crosses itself.
SourceObject extruded(const std::vector<Vec2>& line, double x0, double x1);

void turn_inside_out(SourceObject& object);

template <class Point>
void add_sheet(SourceObject& object, int n, Point point, bool closes) {
  const auto base = static_cast<std::uint32_t>(object.vertices.size());
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j)
      object.vertices.push_back(point(i % (closes ? n : n + 1), j % (closes ? n : n + 1)));
  const auto at = [&](int i, int j) { return base + static_cast<std::uint32_t>(i * (n + 1) + j); };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      object.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      object.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
}

}  // namespace pvsfarm

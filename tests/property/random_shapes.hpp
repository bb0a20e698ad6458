// Shapes for random scenes: solids, convex polygons, and meshes with the faults of real models.
#pragma once

#include <array>

#include "common/base/random.hpp"
#include "common/geometry/box.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm {

// Columns: the images of the coordinate axes under a rotation.
using Frame = std::array<Vec3, 3>;
Frame frame_about_z(double angle);
Frame random_frame(Random& random);
inline Vec3 apply(const Frame& f, const Vec3& p) { return f[0] * p.x + f[1] * p.y + f[2] * p.z; }
void transform(SourceObject& object, const Frame& frame, const Vec3& offset);

// A convex polygon of 3 to 8 points on an ellipse of the given half sides in the plane x = 0.
SourceObject random_polygon(Random& random, double half_y, double half_z);
// A closed star-shaped solid around the origin, outward oriented, its radius noisy.
SourceObject random_star(Random& random, double radius, double noise);
// A closed prism over an L, outward oriented, inside [-s, s]^3.
SourceObject l_prism(double s);
// All sides of a box for fine_box, or with the probability `p` one less.
int sides_but_perhaps_one(Random& random, double p);
// Closed but for that, inside [-s, s]^3: with a hole, notched, crossing itself, or plain.
SourceObject random_solid(Random& random, double s);
// A sheet of hills over [-reach, reach]^2, at heights from 0, its front up.
SourceObject random_hills(Random& random, double reach);
// A wall in the plane x = 0, `columns` x `rows` squares of side `step`, with door and window
// openings where `open(column, row)`.
template <class Open>
SourceObject tessellated_wall(int columns, int rows, double step, Open&& open);

// Gives every triangle its own vertices, each moved by up to `gap`.
void crack(SourceObject& object, double gap, Random& random);
// Drops, doubles, flips or flattens some triangles.
void damage(SourceObject& object, Random& random);

template <class Open>
SourceObject tessellated_wall(int columns, int rows, double step, Open&& open) {
  SourceObject wall;
  for (int r = 0; r <= rows; ++r)
    for (int c = 0; c <= columns; ++c) wall.vertices.push_back({0, c * step, r * step});
  const auto at = [&](int c, int r) { return static_cast<std::uint32_t>(r * (columns + 1) + c); };
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      if (open(c, r)) continue;
      wall.triangles.push_back({at(c, r), at(c + 1, r), at(c + 1, r + 1)});
      wall.triangles.push_back({at(c, r), at(c + 1, r + 1), at(c, r + 1)});
    }
  return wall;
}

}  // namespace pvsfarm

// Meshes the generators build from: all closed and outward oriented unless said otherwise.
// Requires of all: coordinates already snapped, lo < hi.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <string>

#include "common/geometry/box.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm {

void add_box(SourceObject& object, const Box& box);
SourceObject box_object(std::string name, const Box& box);

// A box whose top is another rectangle than its base: `base` gives z and the lower rectangle, `top`
// the upper one.
void add_frustum(SourceObject& object, const Box& base, const Box& top);
// The same in cuts[0] x cuts[1] x cuts[2] pieces along x, y and z: a watertight surface of
// 4 (xy + yz + zx) triangles.
void add_frustum(SourceObject& object, const Box& base, const Box& top,
                 const std::array<int, 3>& cuts);

// A prism: `profile` (convex, counter-clockwise, y to the right and z up, seen from high x) drawn
// along x from `x_lo` to `x_hi`; or along y, when `along_y`, with x for y mirrored.
struct Extrusion {
  std::span<const Vec2> profile;
  double lo = 0, hi = 0;
  bool along_y = false;
};
void add_prism(SourceObject& object, const Extrusion& extrusion);

// A flat rectangle facing up, at height box.lo.z, in tiles no wider than `step`. Not closed.
void add_ground(SourceObject& object, const Box& box, double step);

// The solid cells of a lattice as one watertight mesh without T-junctions: one quad of two
// triangles wherever a solid cell meets a void one.
struct Lattice {
  std::span<const double> xs, ys, zs;  // ascending
  std::function<bool(int, int, int)> solid;
};
void add_lattice(SourceObject& object, const Lattice& lattice);

}  // namespace pvsfarm

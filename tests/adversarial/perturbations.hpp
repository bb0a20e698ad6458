// Changes to a scene and its cells under which a visible set should hardly change, and the faults
// that models have in practice. Each is a pure function of its arguments; what is random follows
// from the seed.
//
// Matter is what the RayOracle makes of the new world: a perturbation need not preserve it exactly.
#pragma once

#include <cstdint>
#include <vector>

#include "common/cells/cell.hpp"
#include "common/scene/scene_source.hpp"
#include "tests/property/random_shapes.hpp"

namespace pvsfarm {

struct World {
  SceneSource source;
  std::vector<Cell> cells;
  // By object: the position that the object it comes from has in the unperturbed world.
  std::vector<std::uint32_t> origin;
};
World world_of(SceneSource source, std::vector<Cell> cells);

// Everything as a whole.

// `frame`: orthonormal up to rounding; may be a reflection. Aligned cells stay aligned if the frame
// only exchanges and reverses axes, else they become oriented ones.
World turned(World world, const Frame& frame);
World moved(World world, const Vec3& offset);
World scaled(World world, double factor);
World renumbered(World world, std::uint64_t seed);

// The vertices. [units] `amount_m`: the farthest that a coordinate moves.

// Vertices of one object that coincide move together, so what is closed stays closed.
World jittered(World world, double amount_m, std::uint64_t seed);
// Every corner of every triangle moves on its own: cracks along all edges.
World torn(World world, double amount_m, std::uint64_t seed);

// The triangles. None but with_t_junctions opens a closed mesh.

// Every triangle into four.
World quartered(World world);
// Every edge into `steps`, every triangle into a fan around its middle.
World fanned(World world, int steps);
// Of the triangles along an edge one is split at the middle of that edge, the other is not.
World with_t_junctions(World world);
// Every triangle into three around a point within `share` of its height over one edge.
World with_slivers(World world, double share);
World with_duplicate_faces(World world);

// The objects.

// Every object twice, in the same place.
World twinned(World world);
// The triangles of every object in turn to two objects: coplanar neighbours belong to different
// ones, and nothing is closed.
World divided(World world);
// Closed boxes that are thinner than `share` of their second side become one rectangle: the middle
// of the box.
World flattened(World world, double share);

// The cells. Each is moved to the object nearest to it; turned cells are made level first.
enum class Contact {
  kFace,    // a face of the cell lies in a side of the object's box
  kEdge,    // only an edge
  kCorner,  // only a corner
  kCut,     // half of the cell in the box
  kInside,  // all of it, shrunk if need be
};
World in_contact(World world, Contact contact);

}  // namespace pvsfarm

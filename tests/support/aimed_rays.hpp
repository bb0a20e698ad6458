// Tries to falsify "these objects are hidden from this cell": casts segments from the cell to
// the boxes of the objects declared hidden, most of them to where mistakes live: box corners and
// surface points seen from the cell's corners, edges and faces, and lines that pass just beside an
// edge of whatever blocked the last attempt.
//
// Hidden verdicts are given to boxes: a point anywhere in the box of one of the object's triangles
// counts, along the axes of the cell; of what moves, anywhere in the object's box. Only segments
// that the ray oracle clears by its margin count (theory F).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/base/random.hpp"
#include "common/cells/cell.hpp"
#include "common/scene/scene_source.hpp"
#include "tests/support/ray_oracle.hpp"

namespace pvsfarm {

struct Violation {
  std::uint32_t object = 0;  // position in the SceneSource
  Segment witness;
};
std::string to_string(const Violation& violation);

struct AimedReport {
  std::uint64_t rays = 0;
  std::vector<Violation> violations;  // the first of each object, at most kMaxViolations
};

// Turns a blocked segment past an edge of its blocker, the triangle `triangle` of `blocker` or
// another of it: through a point just beside the edge, from the same viewpoint to `target`, or
// towards the same point from another viewpoint of `cell`. False: no such line was found.
struct BlockedAim {
  const Cell& cell;
  const Box& target;
  Segment segment;
  const SourceObject& blocker;
  std::uint32_t triangle = 0;
};
bool escape(const BlockedAim& aim, Random& random, Segment& segment);

class AimedRays {
 public:
  static constexpr std::size_t kMaxViolations = 16;

  // Keeps references to both.
  AimedRays(const SceneSource& source, const RayOracle& oracle);

  // Casts at least `rays` rays from `cell` at the `hidden` objects, evenly. No objects: no rays.
  AimedReport search(const Cell& cell, std::span<const std::uint32_t> hidden, std::uint64_t rays,
                     Random& random) const;

 private:
  const SceneSource& source_;
  const RayOracle& oracle_;
  std::vector<Box> boxes_;
};

// A point of the cell: a corner, or on an edge, on a face, or inside.
Vec3 sample_cell(const Cell& cell, Random& random);
// A point of an object's surface; a vertex every few draws.
Vec3 sample_surface(const SourceObject& object, Random& random);

}  // namespace pvsfarm

// What is seen from a cell, from below: millions of rays, cast by Embree at the triangles of a
// scene. Every object in the answer was hit first by some ray, so the truth holds at least these.
//
// Rays are single precision: a crack between two objects that touch may let one through. Whoever
// draws a conclusion from an object that ought not to be there checks its witness in double
// (RayOracle). Vertices are used as floats: exact for generated scenes.
//
// A one-sided triangle met from behind stops the ray and counts as nothing seen; objects that do
// not occlude are seen and let the ray pass. Both can only make the answer smaller.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/random.hpp"
#include "common/cells/cell.hpp"
#include "common/pvs/visible_set.hpp"
#include "common/scene/scene.hpp"
#include "tests/support/ray_oracle.hpp"

namespace pvsfarm {

struct SeenByRays {
  VisibleSet seen;
  std::vector<Segment> witness;  // by object; of meaning where `seen` holds the object
  std::uint64_t rays = 0;
};

class RayCaster {
 public:
  explicit RayCaster(std::shared_ptr<const Scene> scene);
  ~RayCaster();

  // Half of `rays` go in all directions, from all over the cell; the other half at those of
  // `sought` that no ray has seen so far, evenly.
  SeenByRays look(const Cell& cell, const VisibleSet& sought, std::uint64_t rays,
                  Random& random) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm

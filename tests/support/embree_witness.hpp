// Witnesses by the million: casts rays from a cell with Embree and keeps, for each object, one
// segment that sees a point of its surface. Every segment is verified in double by the ray oracle
// before it counts, so the seen set is a lower bound of the truth, and a witness against an object
// declared hidden is a bug.
//
// Objects are named by their position in the SceneSource. Rays pass through what is not opaque.
// Threads: one object, one thread.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/random.hpp"
#include "common/cells/cell.hpp"
#include "common/scene/scene_source.hpp"
#include "tests/support/ray_oracle.hpp"

namespace pvsfarm {

struct WitnessRequest {
  // Rays from all over the cell in all directions, and to surface points of random objects.
  std::uint64_t uniform_rays = 0;
  // Then rays at those of `targets` that no ray has seen yet, in turn, until all are seen.
  std::uint64_t aimed_rays = 0;
  std::span<const std::uint32_t> targets;
};

struct WitnessReport {
  std::uint64_t rays = 0;
  std::vector<std::optional<Segment>> witness;  // by object

  bool seen(std::uint32_t object) const { return witness[object].has_value(); }
  std::size_t seen_count() const;
};

class EmbreeWitness {
 public:
  // Keeps references to both.
  EmbreeWitness(const SceneSource& source, const RayOracle& oracle);
  ~EmbreeWitness();

  WitnessReport sample(const Cell& cell, const WitnessRequest& request, Random& random);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm

// Fuzzy visibility: from how many of a cell's sampled viewpoints each object of its PVS shows, and
// at what solid angle at most. Estimates for the level of detail; nothing is hidden or certified by
// them.
//
// Source: Durand 2000, extended, 7.4, after Lim 1992; theory F. Differs from Durand 2000: the
// degree is of an object as seen from the cell, not of a point of the projection plane.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/random.hpp"
#include "common/pvs/hints.hpp"
#include "common/scene/scene.hpp"
#include "worker/visibility/sampler.hpp"

namespace pvsfarm {

// Threads: one object, one thread.
class HintViews {
 public:
  HintViews(std::shared_ptr<const Scene> scene, std::uint32_t viewpoints);

  // The row of hints of `visible`. Objects of `seen` have a degree of at least 1, for a witness
  // saw them. Everything random is drawn from `seed`, and the row is the same on every machine.
  // Requires: `sampler` has begun this cell; it is left as it was.
  HintBytes look(const Cell& cell, std::uint64_t seed, const VisibleSet& visible,
                 const VisibleSet& seen, Sampler& sampler);
  std::uint64_t rays() const { return rays_; }  // of the last look

 private:
  // Points on one object as they are tried from one viewpoint.
  struct Tried {
    std::uint32_t position = 0;  // in the row
    double share = 0;            // of the solid angle that one point stands for
  };
  void aim(const Vec3& eye, ObjectId object, std::uint32_t position, Sampler& sampler);
  void settle(Sampler& sampler);

  std::shared_ptr<const Scene> scene_;
  std::uint32_t viewpoints_;
  Random random_{0};
  std::uint64_t rays_ = 0;
  std::vector<Sightline> lines_;
  std::vector<SightTarget> targets_;
  std::vector<Tried> tried_;
  std::vector<double> angle_;  // by position: seen from this viewpoint
};

}  // namespace pvsfarm

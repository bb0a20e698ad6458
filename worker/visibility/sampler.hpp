// Witnesses: proofs that an object is seen from a cell. A witness is a segment from a viewpoint in
// the cell to a point on the object with nothing opaque strictly between; it is found with Embree
// and counts only after a check in double precision.
//
// Source: ideas of Lim 1992 and of every sampled visible set (theory F); two-sided certificates are
// theory 0.1 and G.
//
// A segment counts only if it is *robust*: it clears the opaque matter of all other objects by
// margin(), and ends inside a triangle that faces the viewpoint (or is two-sided) by the same
// margin. Rays pass through what is not opaque (objects that do not occlude, or move) and note it
// as seen.
//
// The witnesses are the same on every machine, although Embree's arithmetic is not:
// * Embree only sorts out. Of what its answer suggests, a segment counts if it is robust in double
//   by a *wide* margin, RayScene::float_error of the farthest point of scene and cell. In float a
//   point is rounded by 2^-24 of that distance an axis, when the origin is subtracted and again in
//   the ray's origin and direction, and an edge test is off by a few such roundings; together less
//   than 8 sqrt(3) of them, so 32 leave room. So a segment that is robust by the wide margin is
//   found clear, and the triangle at its end is the first hit, whatever the instruction set; and
//   what is not robust does not count, whatever Embree says. Hence an answer of Embree changes
//   nothing but the time that is spent.
// * The rays cast depend on the seed and on the witnesses found before, on no other answer: rays
//   are turned past the edges of blockers that the check in double names.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/ids.hpp"
#include "common/cells/cell.hpp"
#include "common/pvs/visible_set.hpp"
#include "common/scene/scene.hpp"

namespace pvsfarm {

struct Witness {
  ObjectId object{};
  Vec3 eye{0};    // in the cell, in world coordinates
  Vec3 point{0};  // on the object
};

struct SightCandidate {
  std::uint32_t triangle = 0;
  Vec3 direction{0};  // of any length
};

// What a call of Sampler did. [units] rays: cast with Embree; checks: in double.
struct SamplingRound {
  std::uint64_t rays = 0, checks = 0;
  std::uint32_t seen = 0;  // objects seen for the first time
};

// Threads: one object, one thread.
class Sampler {
 public:
  // `embree_config`: for tests of that claim, as "isa=sse2"; nothing else should need it.
  explicit Sampler(std::shared_ptr<const Scene> scene, const std::string& embree_config = {});
  ~Sampler();

  // Starts a new cell: nothing is seen yet. Everything random is drawn from `seed`.
  // Matter nearer to the eye than near_m proves nothing: segments shorter than that do not count.
  void begin(const Cell& cell, std::uint64_t seed, double near_m);

  // Casts about `rays` rays in all directions from viewpoints all over the cell.
  SamplingRound look_around(std::uint64_t rays);
  // Casts at most `rays` rays at those occludees of `targets` that are not seen yet, in turn, from
  // corners, edges, faces and inner points of the cell; blocked rays are turned past an edge of
  // their blocker. Ends early when all targets are seen.
  SamplingRound aim(const VisibleSet& targets, std::uint64_t rays);

  // Considers lines found by other means: from an eye in the cell, in a direction that is said to
  // meet a triangle of Scene::all_triangles() first. Those that are robust count.
  SamplingRound consider(const Vec3& eye, std::span<const SightCandidate> candidates);

  // Occludees seen so far, whether or not they were targets.
  const VisibleSet& seen() const;
  // One for each seen object, in the order found.
  const std::vector<Witness>& witnesses() const;

  // Triangles of the objects that one viewpoint sees: looks from a few viewpoints at every object
  // seen so far, and gives the largest sum of any one of them (a lower bound of L_pt, theory G).
  std::uint64_t most_triangles_from_a_point(std::uint32_t viewpoints);

  // [units] scene units. What a witness must clear all other matter by.
  double margin() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm

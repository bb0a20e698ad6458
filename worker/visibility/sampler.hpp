// Witnesses: proofs that an object is seen from a cell. A witness is a segment from a viewpoint in
// the cell to a point on the object with nothing opaque strictly between; it is found with Embree
// and counts only after a check in double precision.
//
// Source: ideas of Lim 1992 and of every sampled visible set (theory F); two-sided certificates are
// theory 0.1 and G.
//
// A segment counts only if it is *robust*: it clears the opaque matter of all other objects by
// margin(), and ends inside a triangle that faces the viewpoint (or is two-sided) by the same
// margin. Matter that this triangle surely does not lie behind, such as a blocker that coincides
// with what is drawn, is no obstacle, however near. Rays pass through what is not opaque (objects
// that do not occlude, or move) and note it as seen.
//
// The witnesses are the same on every machine, although Embree's arithmetic is not: Embree only
// names a triangle that seems to block a line, and the line is given up if that triangle, checked
// in double, does; if not, the line is checked in double against everything. Either way a line
// counts exactly if SightCheck::clear says so, and the next line drawn depends on nothing but the
// seed and the lines that counted. No bound of Embree's error is needed.
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
#include "worker/visibility/sight_check.hpp"
#include "worker/visibility/stages.hpp"

namespace pvsfarm {

struct Witness {
  ObjectId object{};
  Vec3 eye{0};    // in the cell, in world coordinates
  Vec3 point{0};  // on the object
};

// What a line is aimed at: a triangle of Scene::all_triangles(), and whose it is.
struct SightTarget {
  ObjectId object{};
  std::uint32_t triangle = 0;
};

// A line said to meet a triangle of Scene::all_triangles() first.
struct SightCandidate {
  std::uint32_t triangle = 0;
  Vec3 direction{0};  // of any length
};

// What a call of Sampler did. [units] rays: lines tried; checks: full ones in double.
struct SamplingRound {
  std::uint64_t rays = 0, checks = 0;
  std::uint32_t seen = 0;  // objects seen for the first time
};

// Threads: one object, one thread.
class Sampler {
 public:
  // `embree_config`: for tests of that claim, as "isa=sse2" or "none".
  explicit Sampler(std::shared_ptr<const Scene> scene, const std::string& embree_config = {});
  ~Sampler();

  // Starts a new cell: nothing is seen yet. Everything random is drawn from `seed`.
  // Matter nearer to the eye than near_m proves nothing: segments shorter than that do not count.
  void begin(const Cell& cell, std::uint64_t seed, double near_m);

  // Casts `rays` rays in all directions from viewpoints all over the cell, in double.
  SamplingRound look_around(std::uint64_t rays);
  // Tries at most about `rays` lines to those occludees of `targets` that are not seen yet, in
  // turn, to corners, rims and random points of theirs, from corners, edges, faces and inner points
  // of the cell; an eighth of them are turned past an edge of their blocker, which finds slits.
  // Ends early when all targets are seen, or when many lines in turn found nothing.
  SamplingRound aim(const VisibleSet& targets, std::uint64_t rays);

  // Considers lines from an eye in the cell, found by other means, in float. One counts if it ends
  // inside its triangle, even as seen from the eye, and clears all else, by float_margin(): a line
  // that does is found by any arithmetic in float, so that those that count do not depend on it.
  SamplingRound consider(const Vec3& eye, std::span<const SightCandidate> candidates);

  // Which lines show the object they are aimed at, seen already or not: 1 if the line is clear but
  // for that object. Nothing is noted. [limit] RayScene::kBatch lines.
  void try_lines(std::span<const Sightline> lines, std::span<const SightTarget> targets,
                 std::span<std::uint8_t> shows);

  // From now on `stages` is told where time goes; null: nobody is.
  void profile(Stages* stages);

  // Occludees seen so far, whether or not they were targets.
  const VisibleSet& seen() const;
  // One for each seen object, in the order found.
  const std::vector<Witness>& witnesses() const;

  // Triangles of the objects that one viewpoint sees: looks from a few viewpoints at every object
  // seen so far, and gives the largest sum of any one of them (a lower bound of L_pt, theory G).
  std::uint64_t most_triangles_from_a_point(std::uint32_t viewpoints);

  // [units] scene units. What a witness must clear all other matter by.
  double margin() const;
  // [units] scene units. 32 * 2^-24 of the distance of the farthest point of scene and cell from
  // the scene's centre. In float a point is rounded by 2^-24 of that an axis, when the origin is
  // subtracted and again in a ray's origin and direction, and an edge test is off by a few more.
  double float_margin() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm

// First hits by the thousand, with Embree: the only include of Embree outside the tests.
//
// Its answers are guesses: in float, relative to the scene's centre, and not the same on every
// machine. What they are good for, and why only robust segments may count, is told in sampler.hpp.
// Opaque and passable matter (what does not occlude, or moves) lie in scenes of their own: rays
// stop at the first and note the second. A one-sided triangle met from its back is not there.
// Left out are triangles so thin that float arithmetic cannot place them; a ray then reports what
// is behind, and the check in double, which knows them, decides.
// Threads: one object, one thread; Embree makes none of its own.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/scene/scene.hpp"
#include "worker/visibility/sight_check.hpp"

namespace pvsfarm {

class RayScene {
 public:
  static constexpr std::uint32_t kNoTriangle = 0xffffffffu;
  static constexpr std::size_t kBatch = 256;

  struct Hit {
    std::uint32_t triangle = kNoTriangle;  // in scene.all_triangles()
    double t = 0;                          // 1 at the point aimed at
  };
  struct Passed {
    std::uint32_t ray = 0, triangle = 0;
  };

  // `error`: what float arithmetic in this scene may displace; see float_error(). `config`: for
  // the device, as "isa=sse2".
  RayScene(const Scene& scene, const Vec3& origin, const std::string& config);
  ~RayScene();

  // [limit] kBatch lines. Fills `hits`, one a line, whatever the distance, and `passed`: the
  // passable triangles met before that, in no order. Triangles for which `skip` has a 1 at their
  // object's place are not noted.
  void cast(std::span<const Sightline> lines, std::span<const std::uint8_t> skip,
            std::span<Hit> hits, std::vector<Passed>& passed);

  // [units] scene units. By what a point may be displaced in this arithmetic, with room to spare,
  // for eyes and points within `reach` of the origin.
  static double float_error(double reach) { return 32 * 0x1p-24 * reach; }

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm

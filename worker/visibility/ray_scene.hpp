// Blockers by the thousand, with Embree: the only include of Embree outside the tests.
//
// Its answers are guesses: in float, relative to the scene's centre, and not the same on every
// machine. So nothing may depend on them but time: the sampler checks in double that a triangle
// named here does block, and where none is named, or the wrong one, it does the whole check itself.
// Where a name is a find (Sampler::look_around), it counts only if no float could doubt it.
// Opaque triangles only; a one-sided one that seems to be met from its back is not named.
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

  // Places are held relative to `origin`. `config`: for the device, as "isa=sse2", or
  // kWithoutEmbree: then no blocker is ever named.
  static constexpr const char* kWithoutEmbree = "none";
  RayScene(const Scene& scene, const Vec3& origin, const std::string& config);
  ~RayScene();
  bool has_embree() const;

  // For each line a triangle, by its number in scene.all_triangles(), that seems to be the first it
  // meets, or kNoTriangle. [limit] kBatch lines.
  void name_blockers(std::span<const Sightline> lines, std::span<std::uint32_t> triangles);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm

// Which occluders are worth projecting from a cell.
//
// Source: Durand 2000, 6.1 (solid angle); theory A.13. Any choice is sound.
#pragma once

#include <cstdint>
#include <vector>

#include "common/pvs/visible_set.hpp"
#include "worker/visibility/occluder_pieces.hpp"

namespace pvsfarm {

// Whether an object that may still be visible, or one that only occludes, owns the occluder.
bool owner_in(const Scene& scene, const Occluder& occluder, const VisibleSet& candidates);

struct RankedOccluder {
  std::uint32_t index = 0;  // into Scene::occluders()
  double solid_angle = 0;   // [sr] roughly, of its box from the cell's centre
};

// The scene's occluders, laid out for being looked at whole for every cell.
// Threads: const after construction.
class OccluderRanking {
 public:
  explicit OccluderRanking(const Scene& scene);

  // Every occluder of at least `least_solid_angle` that an object of `candidates`, or one that
  // only occludes, owns; the `sorted` largest first, by falling solid angle, then the rest in any
  // order. Faces of solids come only where the cell may meet their solid.
  void rank(const CellFrame& frame, const VisibleSet& candidates, double least_solid_angle,
            std::size_t sorted, std::vector<RankedOccluder>& out) const;

 private:
  static constexpr std::uint32_t kNoSingleOwner = ~0u;
  struct Ball {
    float center[3], radius;
    std::uint32_t index;
    std::uint32_t first_face, face_count;  // into faces_
    std::uint32_t owner;                   // the one occludee that owns it; kNoSingleOwner
  };
  const Scene& scene_;
  std::vector<Ball> balls_;           // of every occluder but faces of solids
  std::vector<std::uint32_t> faces_;  // occluder indices, by solid
};

}  // namespace pvsfarm

// Which occluders are worth projecting from a cell.
//
// Source: Durand 2000, 6.1 (solid angle); theory A.13. Any choice is sound.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/pvs/visible_set.hpp"
#include "worker/visibility/occluder_pieces.hpp"

namespace pvsfarm {

// Whether an object that may still be visible, or one that only occludes, owns the occluder.
bool owner_in(const Scene& scene, const Occluder& occluder, const VisibleSet& candidates);

struct RankedOccluder {
  std::uint32_t index = 0;  // into Scene::occluders()
  std::uint32_t ball = 0;   // of the ranking: of the occluder or of the solid it is a face of
  double solid_angle = 0;   // [sr] roughly, of its box from the cell's centre
};

// By falling solid angle: the one order of them.
void sort_ranked(std::span<RankedOccluder> ranked);

// The scene's occluders, laid out for being looked at whole for every cell.
// Threads: const after construction.
class OccluderRanking {
 public:
  explicit OccluderRanking(const Scene& scene);

  // Every occluder of at least `least_solid_angle` that an object of `candidates`, or one that
  // only occludes, owns. The `largest` first of them by falling solid angle, the others in no order
  // (sort_ranked). Faces of solids come only where the cell may meet their solid.
  void rank(const CellFrame& frame, const VisibleSet& candidates, double least_solid_angle,
            std::size_t largest, std::vector<RankedOccluder>& out) const;
  // owner_in() of an occluder that rank() named, in less time.
  bool owned(const RankedOccluder& ranked, const VisibleSet& candidates) const {
    return owned(balls_[ranked.ball], candidates);
  }
  std::uint64_t bytes() const { return balls_.size() * sizeof(Ball); }  // looked at for a cell

 private:
  // The ids of the occludees that own something; all ids if an owner is none.
  struct Owners {
    std::uint32_t first = ~0u, end = 0;
    void add(const Owners& other);
    bool any_in(const VisibleSet& candidates) const;
  };
  struct Ball {
    float center[3], radius;
    std::uint32_t index;
    std::uint32_t first_face, face_count;  // into faces_
    Owners owners;
    bool by_ids;  // who owns it is all in `owners`
  };
  bool owned(const Ball& ball, const VisibleSet& candidates) const;

  // So many balls: most of a scene is seen by no cell, or too small.
  struct Block {
    Owners owners;
    Box around;         // of the balls' middles
    float largest = 0;  // radius
  };

  const Scene& scene_;
  std::vector<Ball> balls_;  // of every occluder but faces of solids
  std::vector<Block> blocks_;
  std::vector<std::uint32_t> faces_;  // occluder indices, by solid
};

}  // namespace pvsfarm

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
  // Looked at for a cell, if no block is passed over.
  std::uint64_t bytes() const { return lanes_.size() * sizeof(Lanes); }

  // Eight of what may be ranked, side by side, in columns.
  struct Lanes {
    alignas(32) float center[3][8] = {}, radius[8] = {};  // a ball around its box
    alignas(64) double lo[3][8] = {}, hi[3][8] = {};      // its box
  };

 private:
  // The ids of the occludees that own something; all ids if an owner is none.
  struct Owners {
    std::uint32_t first = ~0u, end = 0;
    void add(const Owners& other);
    bool any_in(const VisibleSet& candidates) const {
      if (end - first == 1) return candidates.contains(ObjectId{first});
      return first < end && candidates.any_in(first, end - first);
    }
  };
  struct Ball {
    std::uint32_t index = 0;
    std::uint32_t first_face = 0, face_count = 0;  // into faces_
    Owners owners;
    bool by_ids = false;  // who owns it is all in `owners`
  };
  void add_ball(std::uint32_t index);
  void add_faces(std::span<const std::uint32_t> ball_of);
  bool owned(const Ball& ball, const VisibleSet& candidates) const;

  // So many balls: most of a scene is seen by no cell, or too small.
  struct Block {
    Owners owners;
    Box around;         // of the balls' middles
    float largest = 0;  // radius
  };

  const Scene& scene_;
  std::vector<Ball> balls_;   // of every occluder but faces of solids
  std::vector<Lanes> lanes_;  // the same; the last ones of these are empty
  std::vector<Block> blocks_;
  std::vector<std::uint32_t> faces_;  // occluder indices, by solid
};

}  // namespace pvsfarm

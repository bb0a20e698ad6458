// Which of eight boxes can hold occluders that add to a map of a sweep, and to which pixels.
//
// As occluder_screen.hpp: the views of a box bound the views of all that lies in it, so a
// Projection lies in what the eight views of the box have in common. A box of a hierarchy is
// screened as an occluder's own.
// Threads: const after construction.
#pragma once

#include "worker/visibility/occluder_tree.hpp"
#include "worker/visibility/polygon_cover.hpp"

namespace pvsfarm {

class SlabScreen {
 public:
  struct Slab {
    double before = 0, bound = 0;  // depths beyond the face: what is met in between
    // Solids that reach down to `ground` reach down by `ground_depth` more.
    double ground = 0, ground_depth = 0;
  };
  // Keeps references to the first three.
  SlabScreen(const CellFrame& frame, const PolygonPlane& plane, const BitGrid& grid,
             const Slab& slab)
      : frame_(frame), plane_(plane), grid_(grid), slab_(slab) {}

  // The pixels each box may add to; none for the others. Returns a bit for each that has any.
  struct Ranges {
    std::int32_t along_first[8], along_end[8], across_first[8], across_end[8];
    BitRange of(int k) const {
      return {along_first[k], along_end[k] - 1, across_first[k], across_end[k] - 1};
    }
  };
  unsigned screen(const OccluderTree::Block& block, Ranges& ranges) const;

 private:
  const CellFrame& frame_;
  const PolygonPlane& plane_;
  const BitGrid& grid_;
  Slab slab_;
};

}  // namespace pvsfarm

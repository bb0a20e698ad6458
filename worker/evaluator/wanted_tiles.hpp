// Where on a map anything needs to be drawn: in the tiles that something falls on that is still to
// be tested. Elsewhere no test looks, and what is not drawn hides nothing.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/pvs/visible_set.hpp"
#include "common/scene/scene.hpp"
#include "worker/visibility/box_on_planes.hpp"

namespace pvsfarm {

// Threads: one object, one thread. Allocates nothing once warm.
class WantedTiles {
 public:
  // Those of the objects of `open` on each of the planes; planes of one face follow each other.
  void find(const Scene& scene, const CellFrame& frame, const VisibleSet& open,
            std::span<const ProjectionPlane> planes);
  // Leaves them as they are in the map of plane k, and the others to nobody.
  void restrict(std::size_t k, OcclusionMap& map) const;

 private:
  struct Group {
    BoxOnPlanes planes;
    std::size_t first = 0, count = 0;
  };
  void add(const Group& group);

  std::vector<Group> groups_;
  std::vector<int> sides_;                         // tiles a side, by plane
  std::vector<std::vector<std::uint8_t>> wanted_;  // by plane and tile
};

}  // namespace pvsfarm

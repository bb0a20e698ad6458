// What settled one object of a cell, noted while it happens for who asks. Where nobody asks,
// nothing is noted and nothing is paid for it; where somebody does, no answer changes.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/ids.hpp"
#include "common/pvs/inquiry.hpp"
#include "common/scene/scene.hpp"
#include "worker/visibility/occluder_pieces.hpp"
#include "worker/visibility/occlusion_map.hpp"

namespace pvsfarm {

struct Evidence {
  ObjectId object{};  // whom it is about: the question; all else is the answer

  // A prover's certificate: boxes that together hold the object, each with the plane that hides it.
  struct Part {
    Box local_box;                      // in the cell's frame
    std::size_t plane = 0;              // into `planes`
    std::uint32_t objects = 1;          // that were hidden with it as a group
    std::optional<PlaneRect> improved;  // the improved Projection of what of it lies before
                                        // the plane; none: hidden by rule P
  };
  std::vector<Part> parts;           // empty: not hidden
  std::optional<SightLine> witness;  // none: not seen

  // The method that settled it, or else the last prover that could not.
  Method method = Method::kProjection;
  // What that prover had drawn, and where. The occluders point into the scene. No occluders, or
  // fewer than it had: what it drew is not made of Projections (surfaces, slices, a sweep).
  std::vector<ProjectionPlane> planes;
  LocalOccluders occluders;
};

// How many of `open` there are in the node; 0 if what is watched, if anything, is not among them.
std::uint32_t group_of_watched(const Evidence* watched, const VisibleSet& open,
                               const BvhNode& node);

}  // namespace pvsfarm

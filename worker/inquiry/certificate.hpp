// Draws one box's certificate anew, occluder by occluder, to tell who covers which pixels.
//
// The prover drew all occluders into one map and kept only the depths. Here each is drawn by
// itself, with the same code onto the same plane, so that the union is that map, pixel by pixel.
#pragma once

#include <optional>
#include <vector>

#include "common/pvs/inquiry.hpp"
#include "common/scene/scene.hpp"
#include "worker/visibility/direct_raster.hpp"
#include "worker/visibility/occluder_pieces.hpp"
#include "worker/visibility/occlusion_map.hpp"

namespace pvsfarm {

// Threads: one object, one thread.
class Certificate {
 public:
  // Keeps references to the scene and the occluders.
  Certificate(const Scene& scene, const Cell& cell, const LocalOccluders& occluders, double near_m);

  // How far `plane` proves `local_box` hidden, and by whom; none if the box is not wholly beyond
  // the cell's face. `improved`: of what its improved Projection is to be covered. Blockers are
  // picked greedily, whoever covers most of what is not covered yet, so that few are named; the
  // share of each is what it adds.
  std::optional<ExplainFinding::Part> redraw(
      const ProjectionPlane& plane, const Box& local_box,
      const std::optional<PlaneRect>& improved = std::nullopt);

 private:
  // The pixels that one occluder covers before the box, a bit each.
  struct Layer {
    const Occluder* source = nullptr;
    std::vector<std::uint64_t> pixels;
  };
  std::vector<Layer> layers(const ProjectionPlane& plane, const PlaneRect& rect, float depth);
  std::vector<std::uint64_t> covered_pixels(const PixelRange& range, float depth) const;
  void pick_blockers(std::vector<Layer> layers, ExplainFinding::Part& part) const;
  PlanePlace place_of(const ProjectionPlane& plane, const PlaneRect& rect) const;

  const Scene& scene_;
  const Cell cell_;  // as its frame has it
  const LocalOccluders& occluders_;
  double near_m_;
  CellFrame frame_;
  DirectRaster raster_;
  OcclusionMap map_;
};

// A world box around the box of the cell's frame.
Box world_around_local(const Cell& cell, const Box& local_box);

}  // namespace pvsfarm

// The OSMesa rasteriser: coverages as shrunk polygons, one batched draw a map.
//
// Source: Durand 2000, 3.2 and appendix A; theory A.5 (hardware version).
// Differs from Durand 2000: the eight views are intersected on the CPU, so one polygon an occluder
// is drawn instead of eight through the stencil; every half-plane moves inwards by just what makes
// centre sampling imply full coverage, measured against llvmpipe's snapping (kShrinkPx); the
// polygon is made by clipping, never by intersecting neighbouring shifted edges.
#pragma once

#include <memory>

#include "worker/visibility/rasteriser.hpp"

namespace pvsfarm {

class OsmesaRaster final : public Rasteriser {
 public:
  explicit OsmesaRaster(int resolution_px);
  ~OsmesaRaster() override;
  void draw(const CoverageList& list, OcclusionMap& map) override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm

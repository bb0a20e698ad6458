// The row-span rasteriser: inner-conservative coverage on the CPU, in double.
//
// Source: theory A.5. A pixel row's span is the common part of all half-planes at the row's worst
// edge; no vertex of the intersection is ever computed, so thin Projections cannot invert.
// Threads: one object, one thread.
#pragma once

#include <memory>

#include "worker/visibility/rasteriser.hpp"

namespace pvsfarm {

class DirectRaster final : public Rasteriser {
 public:
  DirectRaster();
  ~DirectRaster() override;
  void draw(const CoverageList& list, OcclusionMap& map) override;

 private:
  struct Spans;
  std::unique_ptr<Spans> spans_;
  int tile_px_ = kTilePx;
};

}  // namespace pvsfarm

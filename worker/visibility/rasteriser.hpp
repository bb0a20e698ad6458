// What fills an occlusion map with coverages: one interface, two rasterisers (direct, OSMesa).
//
// A pixel gets min(Z, depth) if it lies wholly in the coverage's rectangle and half-planes, as far
// as the rasteriser can tell; never otherwise. The OSMesa map's coverage is a subset of the direct
// one's, its depths never nearer (held together by a differential test).
#pragma once

#include "worker/visibility/occlusion_map.hpp"
#include "worker/visibility/projection.hpp"

namespace pvsfarm {

class Rasteriser {
 public:
  virtual ~Rasteriser() = default;
  // Adds all coverages of `list` to `map`, which was reset with the plane they were made for.
  virtual void draw(const CoverageList& list, OcclusionMap& map) = 0;
  // What it wrote since it was made. [units] rows of kTilePx pixels
  std::uint64_t rows_written() const { return rows_written_; }

 protected:
  std::uint64_t rows_written_ = 0;
};

}  // namespace pvsfarm

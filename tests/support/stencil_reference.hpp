// Appendix A of the paper: the stencil buffer intersects the eight views of an occluder. A third
// rasteriser, slow and by another road, that the two of worker/ are held against.
//
// Source: Durand 2000, appendix A; theory A.7. Each view of a piece sets its bit of the stencil
// where it passes the depth test; where all eight bits stand, the depth is written.
// Differs from Durand 2000: the stencil is cleared before every piece; a bit a view instead of a
// count, so a pixel that two triangles of one view touch counts once; a pixel must hold all eight
// before its depth is written; the depth is the piece's largest, equal for all views.
// Threads: one a process, as OsmesaContext says.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "worker/visibility/cell_frame.hpp"
#include "worker/visibility/occluder_pieces.hpp"

namespace pvsfarm {

class StencilReference {
 public:
  explicit StencilReference(int side_px);
  ~StencilReference();

  // The depths of a map of `side_px` pixels a side on `plane`, row by row from the bottom; infinity
  // where nothing covers. Depths are right up to 2^-22 of the range of depths drawn.
  // Requires: pieces on one side of the plane each, as make_pieces gives them.
  std::vector<float> draw(std::span<const Piece> pieces, const ProjectionPlane& plane);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm

// Whether a cell is better swept than projected: where nothing is as wide as the cell, nothing
// casts a shadow of its own that goes on, and what is hidden is hidden by many together.
//
// Shape: what part of all that occludes is narrow against the cell. Nothing else is asked: it is
// the same for a cell whoever evaluates it and when, and for a scene of walls the answer is no
// without a look at the cell's surroundings.
// Threads: const after construction; share freely.
#pragma once

#include <array>

#include "common/cells/cell.hpp"
#include "common/scene/scene.hpp"

namespace pvsfarm {

// How wide the occluders of a scene are, by area. An occluder is as wide as the second longest
// side of its box.
class OccluderWidths {
 public:
  // Of its pieces; their area is the product of the two longest sides.
  static OccluderWidths of_pieces(const Scene& scene);
  // Of what hangs together: the walls of a level are one surface, however small their faces.
  static OccluderWidths of_surfaces(const Scene& scene);
  // 0 .. 1: the part in occluders narrower than `width`, by no more than a seventh; 0 if there are
  // no occluders.
  double share_narrower_than(double width) const;

 private:
  static constexpr int kSteps = 8, kOctaves = 128;  // an octave's steps; octaves about 1
  static int bucket(double width);
  void add(const Box& box, double area);
  std::array<double, kSteps * kOctaves> area_{};
};

// Whether hardly anything is as wide as the cell. Of pieces: then the sweep comes before
// Projections, and in their place if it settles enough. Of surfaces: then none blocks it.
bool all_narrow(const OccluderWidths& widths, const Cell& cell);

// Of the open triangles, the part that a sweep has to settle to stand in for Projections.
inline constexpr double kSweptEnough = 0.5;

}  // namespace pvsfarm

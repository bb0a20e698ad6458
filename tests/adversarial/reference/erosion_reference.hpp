// Erosion: an object is hidden from a cell if, from one point, its shrunk form is hidden by shrunk
// occluders. In the plane, exactly: the cell at the left, the object at the right, rectangles.
//
// Source: Décoret 2003, 3.1 to 4.4; theory E.1, E.2, E.4, I 33. As printed it replaces the cell by
// the segment between the points where the shaft to the object touches it; rays that leave the
// cell beside that segment escape. The same trick on the object's side loses most of the object.
#pragma once

#include <vector>

#include "tests/adversarial/reference/flat_geometry.hpp"

namespace pvsfarm::reference {

struct ErosionScene {
  Rect cell, object;        // the object to the right of the cell
  std::vector<Rect> walls;  // between them
};

// What stands for the cell.
enum class Source {
  kCell,               // all of it: theorem 1
  kSupportingSegment,  // as printed (3.3)
  kGate,               // where rays to the object cross the line along the cell's right side
};
// Whether the erosion proves the object hidden. Exact. Requires: even coordinates of both.
bool hides_by_erosion(const ErosionScene& scene, Source source);

// As printed (4.4): occluders eroded by all of a flat cell, the object cut to what is seen from its
// middle through the eroded supporting segment of the object, or to the middle of that segment.
// Requires: the same, and cell.lo.x == cell.hi.x.
bool hides_by_stencil(const ErosionScene& scene);

// A segment from the cell to the object that no wall meets, by aiming past the ends of walls.
struct FlatSegment {
  FlatPoint from, to;
};
bool find_witness(const ErosionScene& scene, FlatSegment& witness);
bool is_clear(const ErosionScene& scene, const FlatSegment& segment);

}  // namespace pvsfarm::reference

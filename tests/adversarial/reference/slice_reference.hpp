// Slices: the cut of a solid by the projection plane covers what it covers, for no ray from outside
// reaches the inside without meeting the surface.
//
// Source: Durand 2000, 3.3; theory A.12, I 14. The paper does not say that the surface must be
// watertight and the cell outside; without either the cut covers nothing.
#pragma once

#include <optional>

#include "common/geometry/box.hpp"

#include "tests/adversarial/reference/shield_tube.hpp"

namespace pvsfarm::reference {

enum class SliceCheck {
  kNone,                  // as printed: fill whatever contour there is
  kWatertightAndOutside,  // of the mesh, and of the cell
};

class Slice {
 public:
  // The cut at height z. None: it must be ignored. Vertices at the height count as above it.
  static std::optional<Slice> of(const TriangleMesh& mesh, std::int64_t z, const IntBox& cell,
                                 SliceCheck check);

  // Whether the cut holds all of the rectangle, by the even-odd rule along +x.
  bool covers(const Box& rectangle) const;
  // Whether it hides a box strictly beyond the plane.
  bool hides(const IntBox& cell, const IntBox& occludee) const;

 private:
  struct Segment {
    Vec3 a, b;
  };
  std::int64_t z_ = 0;
  std::vector<Segment> contour_;
};

}  // namespace pvsfarm::reference

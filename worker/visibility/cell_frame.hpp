// The cell's own coordinate frame, and the frames of the projection planes before its faces.
//
// Source: theory A.1. Conventions, used by every file of this folder:
// * local frame: the cell's centre is 0, its axes are the coordinate axes, half extents `half`;
//   the centre is subtracted in double before anything else (theory 0.5).
// * plane frame of face f at distance D: x, y along the face, z = distance beyond the plane,
// growing
//   away from the cell. Cell: z in [-D - 2 hw, -D]; face plane z = -D; projection plane z = 0.
#pragma once

#include <array>

#include "common/cells/cell.hpp"
#include "common/geometry/box.hpp"

namespace pvsfarm {

// The same box of space, its first axis turned around if its axes are a left-handed frame.
Cell right_handed(Cell cell);

// Maps the world linearly so that the cell lies in the box [-half, half]. Visibility does not
// change under a linear map, so axes that are orthonormal only up to rounding do no harm: `half` is
// widened by what they skew. The frame is that of right_handed(cell): front and back are told by
// the turns of corners.
class CellFrame {
 public:
  explicit CellFrame(const Cell& given);

  Vec3 local_from_world(const Vec3& p) const {
    const Vec3 d = p - origin_;
    if (aligned_) return d - middle_;
    return Vec3{dot(axes_[0], d), dot(axes_[1], d), dot(axes_[2], d)} - middle_;
  }
  // A local box around the world box, widened by all rounding: for occludees, never occluders.
  Box local_around_world(const Box& box) const;
  // The same around a point.
  Box local_around_point(const Vec3& p) const;
  const Vec3& half() const { return half_; }
  bool aligned() const { return aligned_; }  // the cell's axes are the world's
  const std::array<Vec3, 3>& axes() const { return axes_; }
  Box world_bounds() const { return world_bounds_; }
  // Added to the size of a local point, a bound of what its rounding is relative to.
  double offset_scale() const { return aligned_ ? 0.0 : length(middle_); }

 private:
  Vec3 origin_, middle_, half_;
  std::array<Vec3, 3> axes_;
  bool aligned_;
  Box world_bounds_;
};

// One of the six faces: axis 0..2, sign -1 or +1.
struct Face {
  int axis = 0;
  int sign = 1;
  int u() const { return (axis + 1) % 3; }
  int v() const { return (axis + 2) % 3; }
};
inline constexpr std::array<Face, 6> kFaces{Face{0, 1},  Face{0, -1}, Face{1, 1},
                                            Face{1, -1}, Face{2, 1},  Face{2, -1}};

// A projection plane: a finite rectangle of pixels at `distance` beyond a face.
struct ProjectionPlane {
  Face face;
  double distance = 1;            // D > 0
  double hu = 0, hv = 0, hw = 0;  // the cell's half extents along x, y, z of this frame
  double x0 = 0, y0 = 0;          // lower corner of the rectangle
  double px = 1, py = 1;          // pixel size
  int resolution_px = 0;          // pixels a side

  double x1() const { return x0 + px * resolution_px; }
  double y1() const { return y0 + py * resolution_px; }
  // Distance of a local point beyond the face (not beyond the plane).
  double beyond_face(const Vec3& local) const { return face.sign * local[face.axis] - hw; }
  Vec3 plane_from_local(const Vec3& local) const {
    return {local[face.u()], local[face.v()], beyond_face(local) - distance};
  }
  Box plane_from_local(const Box& local) const {
    const double a = face.sign * local.lo[face.axis], b = face.sign * local.hi[face.axis];
    return {{local.lo[face.u()], local.lo[face.v()], std::min(a, b) - hw - distance},
            {local.hi[face.u()], local.hi[face.v()], std::max(a, b) - hw - distance}};
  }
};

// The plane before `face` at `distance`, with the rectangle [-extent * (h + D), extent * (h + D)].
ProjectionPlane square_plane(const CellFrame& frame, Face face, double distance, double extent,
                             int resolution_px);

}  // namespace pvsfarm

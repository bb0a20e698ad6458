// Where on a projection plane an edge may come between a point and the cell: an outer bound of the
// union of its views from all of the cell.
//
// Source: docs/algorithm.md A.14. The shadow of an edge e from the cell C is
// { p in the plane : conv({p} u C) meets e } = plane n { m + t (m - v) : m in e, v in C, t >= 0 }.
// It is convex, and without end where part of the edge lies beside the cell. It is bounded here by
// four strips, two along the axes and two fitted to the edge.
#pragma once

#include <array>
#include <span>

#include "worker/visibility/cell_frame.hpp"

namespace pvsfarm {

// Points p with lo[k] <= n_k . p <= hi[k] for all k; n_0 = x, n_1 = y, n_2 and n_3 = (nx, ny).
// Rounding is already in lo and hi. No point at all if lo[0] > hi[0].
struct Shadow {
  std::array<double, 2> nx{}, ny{};
  std::array<double, 4> lo{1, 0, 0, 0}, hi{0, 0, 0, 0};

  bool empty() const { return lo[0] > hi[0]; }
  // Whether a rectangle with this centre and these half sides may meet it.
  bool meets(double x, double y, double half_x, double half_y) const {
    if (!(x + half_x >= lo[0] && x - half_x <= hi[0])) return false;
    if (!(y + half_y >= lo[1] && y - half_y <= hi[1])) return false;
    for (int k = 0; k < 2; ++k) {
      const double at = nx[k] * x + ny[k] * y;
      const double reach =
          (nx[k] < 0 ? -nx[k] : nx[k]) * half_x + (ny[k] < 0 ? -ny[k] : ny[k]) * half_y;
      if (!(at + reach >= lo[k + 2] && at - reach <= hi[k + 2])) return false;
    }
    return true;
  }
};

// Threads: const after construction.
class ShadowMaker {
 public:
  // `frame_scale`: CellFrame::offset_scale(). `largest`: no coordinate of a point, in the plane's
  // frame, is larger.
  ShadowMaker(const ProjectionPlane& plane, double frame_scale, double largest);

  // How far a point's z may be off, generously: what lies nearer to the plane than this may meet
  // it.
  double depth_tolerance() const { return tolerance_; }
  // Of the part of the edge before the plane. `beyond`: faces of the cell that both ends are surely
  // at or beyond, by plane axis: bit 0 x low, 1 x high, 2 y low, 3 y high.
  Shadow of_edge(const Vec3& a, const Vec3& b, unsigned beyond) const;
  // Where a triangle meets the plane. Requires that it comes as near as depth_tolerance().
  Shadow of_section(const Vec3 (&triangle)[3]) const;

 private:
  struct Spread;
  void add_far(const Vec3& point, Spread& spread) const;
  void add_near(const Vec3& point, double alpha, Spread& spread) const;
  Shadow bound(const Spread& spread, double dx, double dy) const;

  const ProjectionPlane& plane_;
  double scale_, tolerance_, far_from_;
};

}  // namespace pvsfarm

#include "worker/visibility/projection.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/geometry/rounding.hpp"

namespace pvsfarm {
namespace {

// All images of a piece, separated by axis: x depends on the viewpoint only through (Vx, Vz).
// Index of a viewpoint: bit 0 its x (or y) sign, bit 1 front (1) or back (0) face.
struct Images {
  double x[4][kMaxPiecePoints];
  double y[4][kMaxPiecePoints];
  double rounding = 0;  // no image is farther than this from the true one
  double margin = 0;    // what edges are moved inwards by: rounding and the pixel grid's own

  // A point is off by at most 2^-49 scale (frame, clipping); alpha by the same relative to itself
  // times scale over the distance from the viewpoint, which 1 + alpha bounds through D / delta.
  void set_rounding(double largest_alpha, double scale, const ProjectionPlane& plane) {
    rounding = 0x1p-44 * (1 + largest_alpha) * (1 + largest_alpha) * scale;
    margin = rounding + 1e-6 * std::min(plane.px, plane.py);
  }
};

// View of M from V on z = 0: V + (M - V) * alpha, alpha = -Vz / (Mz - Vz).
void make_images(const Piece& piece, const ProjectionPlane& plane, double frame_scale,
                 Images& images) {
  const double depth_back = plane.distance + 2 * plane.hw, depth_front = plane.distance;
  double scale = frame_scale + plane.hu + plane.hv + depth_back, largest_alpha = 0;
  for (int i = 0; i < piece.point_count; ++i) {
    const Vec3& p = piece.points[i];
    scale = std::max({scale, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    const double back = depth_back / (p.z + depth_back), front = depth_front / (p.z + depth_front);
    largest_alpha = std::max({largest_alpha, back, front});
    for (int k = 0; k < 4; ++k) {
      const double alpha = (k & 2) ? front : back;
      const double vx = (k & 1) ? plane.hu : -plane.hu, vy = (k & 1) ? plane.hv : -plane.hv;
      images.x[k][i] = vx + (p.x - vx) * alpha;
      images.y[k][i] = vy + (p.y - vy) * alpha;
    }
  }
  images.set_rounding(largest_alpha, scale, plane);
}

// The same for an axis-aligned box: a coordinate of a corner's image depends on two of its own.
void make_box_images(const Box& box, const ProjectionPlane& plane, double frame_scale,
                     Images& images) {
  const double depth_back = plane.distance + 2 * plane.hw, depth_front = plane.distance;
  double scale = frame_scale + plane.hu + plane.hv + depth_back, largest_alpha = 0;
  for (int a = 0; a < 3; ++a) scale = std::max({scale, std::abs(box.lo[a]), std::abs(box.hi[a])});
  for (int far = 0; far < 2; ++far) {
    const double z = far ? box.hi.z : box.lo.z;
    const double back = depth_back / (z + depth_back), front = depth_front / (z + depth_front);
    largest_alpha = std::max({largest_alpha, back, front});
    for (int k = 0; k < 4; ++k) {
      const double alpha = (k & 2) ? front : back;
      const double vx = (k & 1) ? plane.hu : -plane.hu, vy = (k & 1) ? plane.hv : -plane.hv;
      double *const x = images.x[k] + 4 * far, *const y = images.y[k] + 4 * far;
      x[0] = x[2] = vx + (box.lo.x - vx) * alpha;
      x[1] = x[3] = vx + (box.hi.x - vx) * alpha;
      y[0] = y[1] = vy + (box.lo.y - vy) * alpha;
      y[2] = y[3] = vy + (box.hi.y - vy) * alpha;
    }
  }
  images.set_rounding(largest_alpha, scale, plane);
}

// The common rectangle of the eight views, in the plane's rectangle; it may be turned inside out.
PlaneRect common_rectangle(const Images& images, const Piece& piece, const ProjectionPlane& plane) {
  const int n = piece.point_count;
  PlaneRect r{plane.x0, plane.y0, plane.x1(), plane.y1()};
  const auto narrow = [&](double xa, double xb, double ya, double yb) {
    r.x0 = std::max(r.x0, xa + images.margin);
    r.x1 = std::min(r.x1, xb - images.margin);
    r.y0 = std::max(r.y0, ya + images.margin);
    r.y1 = std::min(r.y1, yb - images.margin);
  };
  for (int k = 0; k < 4; ++k) {
    const double *const x = images.x[k], *const y = images.y[k];
    if (piece.box_shaped) {  // points are in the order of Box::corner
      narrow(std::min(x[0], x[4]), std::max(x[1], x[5]), std::min(y[0], y[4]),
             std::max(y[2], y[6]));
      continue;
    }
    const auto [xa, xb] = std::minmax_element(x, x + n);
    const auto [ya, yb] = std::minmax_element(y, y + n);
    narrow(*xa, *xb, *ya, *yb);
  }
  return r;
}

class Builder {
 public:
  Builder(const Images& images, const ProjectionPlane& plane, const PlaneRect& rect,
          CoverageList& out)
      : images_(images),
        map_size_(plane.x1() - plane.x0 + plane.y1() - plane.y0),
        rect_(rect),
        out_(out) {}

  // The points left of the line from image a to image b of view (kx, ky), moved inwards.
  void add_edge(int kx, int ky, int a, int b, double extra_margin = 0) {
    const double ax = images_.x[kx][a], ay = images_.y[ky][a];
    const double nx = ay - images_.y[ky][b], ny = images_.x[kx][b] - ax;
    const double at = nx * ax + ny * ay;
    const double rounding = 0x1p-48 * (std::abs(nx * ax) + std::abs(ny * ay));
    // The ends are off by `rounding`; along the line, over the whole map, so is its direction.
    const auto moved = [&](double size) {
      return at + (images_.margin * size + images_.rounding * map_size_ + extra_margin * size) +
             rounding;
    };
    // Most half-planes hold the whole rectangle: they cut nothing.
    const double x = nx * (nx > 0 ? rect_.x0 : rect_.x1), y = ny * (ny > 0 ? rect_.y0 : rect_.y1);
    const double worst = x + y - 0x1p-48 * (std::abs(x) + std::abs(y));
    if (worst >= moved(std::abs(nx) + std::abs(ny))) return;
    const double size = std::sqrt(nx * nx + ny * ny);
    if (!(size > 0)) return;
    out_.half_planes.push_back({nx, ny, moved(size)});
  }

 private:
  const Images& images_;
  double map_size_;
  PlaneRect rect_;
  CoverageList& out_;
};

// A view of an axis-aligned box is the hull of two homothetic rectangles (its near and its far
// face): four sides that the common rectangle already holds, and at most two oblique edges, the
// images of the box's edges along z.
void add_box_view(const Images& images, int kx, int ky, Builder& builder) {
  // Corner of the face: bit 0 x hi, bit 1 y hi; counter-clockwise order 0 1 3 2.
  static constexpr int kSignX[4] = {-1, 1, -1, 1}, kSignY[4] = {-1, -1, 1, 1};
  for (int c = 0; c < 4; ++c) {
    const int near = c, far = c + 4;  // Box::corner: bit 2 picks z
    const double dx = kSignX[c] * (images.x[kx][near] - images.x[kx][far]);
    const double dy = kSignY[c] * (images.y[ky][near] - images.y[ky][far]);
    if ((dx > 0) == (dy > 0)) continue;  // one face's corner lies inside the other's quadrant
    // The corner that sticks out along x, and the one that sticks out along y. Counter-clockwise
    // around the hull: for lower right and upper left corners x comes after y, else before.
    const int out_x = dx > 0 ? near : far, out_y = dx > 0 ? far : near;
    const bool y_first = kSignX[c] * kSignY[c] < 0;
    builder.add_edge(kx, ky, y_first ? out_y : out_x, y_first ? out_x : out_y);
  }
}

// Andrew's monotone chain; returns the hull's size, indices counter-clockwise in `hull`.
int convex_hull(const double* x, const double* y, int n, int* hull) {
  int order[kMaxPiecePoints];
  for (int i = 0; i < n; ++i) order[i] = i;
  std::sort(order, order + n,
            [&](int a, int b) { return x[a] < x[b] || (x[a] == x[b] && y[a] < y[b]); });
  const auto turn = [&](int o, int a, int b) {
    return (x[a] - x[o]) * (y[b] - y[o]) - (y[a] - y[o]) * (x[b] - x[o]);
  };
  int k = 0;
  for (int i = 0; i < n; ++i) {
    while (k >= 2 && turn(hull[k - 2], hull[k - 1], order[i]) <= 0) --k;
    hull[k++] = order[i];
  }
  for (int i = n - 2, low = k + 1; i >= 0; --i) {
    while (k >= low && turn(hull[k - 2], hull[k - 1], order[i]) <= 0) --k;
    hull[k++] = order[i];
  }
  return k - 1;
}

bool add_hull_view(const Images& images, int kx, int ky, int n, Builder& builder) {
  int hull[2 * kMaxPiecePoints];
  const int size = convex_hull(images.x[kx], images.y[ky], n, hull);
  if (size < 3) return false;
  for (int i = 0; i < size; ++i) builder.add_edge(kx, ky, hull[i], hull[(i + 1) % size]);
  return true;
}

// The loop's own edges, in order: the hull of the points need not be matter, the loop's inside is.
bool add_loop_view(const Images& images, int kx, int ky, const Piece& piece,
                   const ProjectionPlane& plane, Builder& builder) {
  const int n = piece.point_count;
  double area = 0;
  for (int i = 1; i + 1 < n; ++i)
    area += (images.x[kx][i] - images.x[kx][0]) * (images.y[ky][i + 1] - images.y[ky][0]) -
            (images.x[kx][i + 1] - images.x[kx][0]) * (images.y[ky][i] - images.y[ky][0]);
  if (area == 0) return false;
  for (int i = 0; i < n; ++i) {
    double extra = 0;
    if ((i == piece.cut_edges[0] || i == piece.cut_edges[1]) && piece.flatness > 0) {
      // The matter's own border in the cutting plane is within 2 flatness / sine of the cut.
      if (!(piece.cut_sine > 1e-3)) return false;
      const double alpha = plane.distance / (piece.points[i].z + plane.distance);
      extra = 4 * piece.flatness / piece.cut_sine * alpha;
    }
    const int next = (i + 1) % n;
    builder.add_edge(kx, ky, area > 0 ? i : next, area > 0 ? next : i, extra);
  }
  return true;
}

}  // namespace

bool project(const Piece& piece, const ProjectionPlane& plane, double frame_scale,
             CoverageList& out, const OcclusionMap* drawn) {
  Images images;
  if (piece.box_shaped)
    make_box_images(piece.box, plane, frame_scale, images);
  else
    make_images(piece, plane, frame_scale, images);

  // The common rectangle of the eight views: cheap, and empty for most distant occluders.
  const PlaneRect rect = common_rectangle(images, piece, plane);
  if (!(rect.x1 - rect.x0 >= plane.px) || !(rect.y1 - rect.y0 >= plane.py)) return false;

  const PixelRange inner = whole_pixels(rect, plane);
  if (inner.i0 > inner.i1 || inner.j0 > inner.j1) return false;
  const double deepest = piece.box.hi.z + (piece.solid ? 0.0 : 2 * piece.flatness);
  const double rounding = 0x1p-46 * (std::abs(deepest) + plane.distance + frame_scale);
  const float depth = float_not_below(deepest + rounding);
  if (drawn != nullptr && drawn->needs_nothing(inner, depth)) return false;

  const auto first = static_cast<std::uint32_t>(out.half_planes.size());
  Builder builder(images, plane, rect, out);
  for (int view = 0; view < 8; ++view) {
    const int front = (view >> 2) * 2, kx = (view & 1) + front, ky = ((view >> 1) & 1) + front;
    bool full = true;
    if (piece.box_shaped) {
      add_box_view(images, kx, ky, builder);
    } else if (piece.solid) {
      full = add_hull_view(images, kx, ky, piece.point_count, builder);
    } else {
      full = add_loop_view(images, kx, ky, piece, plane, builder);
    }
    if (!full) {
      out.half_planes.resize(first);
      return false;
    }
  }
  out.coverages.push_back({rect.x0, rect.y0, rect.x1, rect.y1, depth, first,
                           static_cast<std::uint32_t>(out.half_planes.size()) - first});
  return true;
}

}  // namespace pvsfarm

#include "worker/visibility/projection.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "common/geometry/rounding.hpp"
#include "worker/visibility/dispatch.hpp"
#include "worker/visibility/lanes.hpp"

namespace pvsfarm {
namespace {

// A point is off by at most 2^-49 scale (frame, clipping); alpha by the same relative to itself
// times scale over the distance from the viewpoint, which 1 + alpha bounds through D / delta.
PVSFARM_INLINE double rounding_of(double largest_alpha, double scale) {
  return 0x1p-44 * (1 + largest_alpha) * (1 + largest_alpha) * scale;
}
PVSFARM_INLINE double margin_of(double rounding, const ProjectionPlane& plane) {
  return rounding + 1e-6 * std::min(plane.px, plane.py);
}

// All images of a piece, separated by axis: x depends on the viewpoint only through (Vx, Vz).
// Index of a viewpoint: bit 0 its x (or y) sign, bit 1 front (1) or back (0) face.
struct Images {
  double x[4][kMaxPiecePoints];
  double y[4][kMaxPiecePoints];
  double rounding = 0;  // no image is farther than this from the true one
  double margin = 0;    // what edges are moved inwards by: rounding and the pixel grid's own
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
  images.rounding = rounding_of(largest_alpha, scale);
  images.margin = margin_of(images.rounding, plane);
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

// An axis-aligned box from the cell's eight vertices, a lane each: a coordinate of a corner's image
// depends on two of its own. Near or far, low or high.
struct BoxViews {
  Eight x[2][2], y[2][2];
  double rounding = 0, margin = 0;  // as those of Images
};

PVSFARM_DISPATCH
void look_at_box(const Box& box, const ProjectionPlane& plane, double frame_scale, BoxViews& views,
                 PlaneRect& rect) {
  const double hu = plane.hu, hv = plane.hv, front = plane.distance, back = front + 2 * plane.hw;
  const Eight vx{-hu, hu, -hu, hu, -hu, hu, -hu, hu}, vy{-hv, -hv, hv, hv, -hv, -hv, hv, hv};
  const Eight depth{back, back, back, back, front, front, front, front};
  double scale = frame_scale + hu + hv + back;
  for (int a = 0; a < 3; ++a) scale = std::max({scale, std::abs(box.lo[a]), std::abs(box.hi[a])});
  Eight largest_alpha = all_lanes(0);
  for (int far = 0; far < 2; ++far) {
    const Eight alpha = depth / ((far ? box.hi.z : box.lo.z) + depth);
    largest_alpha = larger(alpha, largest_alpha);
    views.x[far][0] = vx + (box.lo.x - vx) * alpha;
    views.x[far][1] = vx + (box.hi.x - vx) * alpha;
    views.y[far][0] = vy + (box.lo.y - vy) * alpha;
    views.y[far][1] = vy + (box.hi.y - vy) * alpha;
  }
  views.rounding = rounding_of(largest(largest_alpha), scale);
  views.margin = margin_of(views.rounding, plane);
  rect.x0 = std::max(plane.x0, largest(smaller(views.x[0][0], views.x[1][0])) + views.margin);
  rect.x1 = std::min(plane.x1(), smallest(larger(views.x[0][1], views.x[1][1])) - views.margin);
  rect.y0 = std::max(plane.y0, largest(smaller(views.y[0][0], views.y[1][0])) + views.margin);
  rect.y1 = std::min(plane.y1(), smallest(larger(views.y[0][1], views.y[1][1])) - views.margin);
}

// nx * x + ny * y >= at + more, but for what edges are moved inwards by.
struct BoxEdges {
  alignas(64) double nx[8], ny[8], at[8], more[8];
};

// A view of an axis-aligned box is the hull of two homothetic rectangles (its near and its far
// face): four sides that the common rectangle already holds, and at most two oblique edges, the
// images of the box's edges along z. Here those of one corner of the faces: bit 0 high x, bit 1
// high y. Returns a bit for each view whose edge cuts the rectangle.
PVSFARM_DISPATCH
unsigned find_box_edges(const BoxViews& views, int corner, const PlaneRect& rect, double map_size,
                        BoxEdges& edges) {
  const int cx = corner & 1, cy = corner >> 1;
  const Eight &near_x = views.x[0][cx], &far_x = views.x[1][cx];
  const Eight &near_y = views.y[0][cy], &far_y = views.y[1][cy], none = all_lanes(0);
  const Eight dx = cx ? near_x - far_x : far_x - near_x;
  const Eight dy = cy ? near_y - far_y : far_y - near_y;
  // The corner that sticks out along x, and the one that sticks out along y. Counter-clockwise
  // around the hull: for lower right and upper left corners x comes after y, else before. Where one
  // sticks out along both, the other lies inside its quadrant.
  const Eight out_x = above(dx, none), out_y = above(dy, none);
  const Eight near_first = cx == cy ? out_x : all_lanes(1) - out_x;
  const Eight ax = choose(near_first, near_x, far_x), bx = choose(near_first, far_x, near_x);
  const Eight ay = choose(near_first, near_y, far_y), by = choose(near_first, far_y, near_y);
  const Eight nx = ay - by, ny = bx - ax, tx = nx * ax, ty = ny * ay;
  const Eight at = tx + ty, rounding = 0x1p-48 * (magnitude(tx) + magnitude(ty));
  store_lanes(edges.nx, nx);
  store_lanes(edges.ny, ny);
  store_lanes(edges.at, at);
  store_lanes(edges.more, rounding);
  // Most half-planes hold the whole rectangle: they cut nothing.
  const Eight x = nx * choose(above(nx, none), all_lanes(rect.x0), all_lanes(rect.x1));
  const Eight y = ny * choose(above(ny, none), all_lanes(rect.y0), all_lanes(rect.y1));
  const Eight worst = x + y - 0x1p-48 * (magnitude(x) + magnitude(y));
  const Eight size = magnitude(nx) + magnitude(ny);
  const Eight moved = at + (views.margin * size + views.rounding * map_size) + rounding;
  const Eight odd = out_x - out_y;
  return bits_of(choose(not_above(moved, worst), none, odd * odd));
}

void add_box_edges(const BoxViews& views, const ProjectionPlane& plane, const PlaneRect& rect,
                   CoverageList& out) {
  const double map_size = plane.x1() - plane.x0 + plane.y1() - plane.y0;
  BoxEdges edges;
  for (int corner = 0; corner < 4; ++corner) {
    unsigned cutting = find_box_edges(views, corner, rect, map_size, edges);
    for (; cutting != 0; cutting &= cutting - 1) {
      const int k = std::countr_zero(cutting);
      const double nx = edges.nx[k], ny = edges.ny[k], size = std::sqrt(nx * nx + ny * ny);
      if (!(size > 0)) continue;
      out.half_planes.push_back(
          {nx, ny,
           edges.at[k] + (views.margin * size + views.rounding * map_size) + edges.more[k]});
    }
  }
}

// Appends the half-planes of all views. False: some view is empty.
bool add_views(const Images& images, const Piece& piece, const ProjectionPlane& plane,
               const PlaneRect& rect, CoverageList& out) {
  Builder builder(images, plane, rect, out);
  for (int view = 0; view < 8; ++view) {
    const int front = (view >> 2) * 2, kx = (view & 1) + front, ky = ((view >> 1) & 1) + front;
    if (piece.solid ? !add_hull_view(images, kx, ky, piece.point_count, builder)
                    : !add_loop_view(images, kx, ky, piece, plane, builder))
      return false;
  }
  return true;
}

}  // namespace

bool project(const Piece& piece, const ProjectionPlane& plane, double frame_scale,
             CoverageList& out, const OcclusionMap* drawn) {
  // The common rectangle of the eight views: cheap, and empty for most distant occluders.
  Images images;
  BoxViews views;
  PlaneRect rect;
  if (piece.box_shaped) {
    look_at_box(piece.box, plane, frame_scale, views, rect);
  } else {
    make_images(piece, plane, frame_scale, images);
    rect = common_rectangle(images, piece, plane);
  }
  if (!(rect.x1 - rect.x0 >= plane.px) || !(rect.y1 - rect.y0 >= plane.py)) return false;

  const PixelRange inner = whole_pixels(rect, plane);
  if (inner.i0 > inner.i1 || inner.j0 > inner.j1) return false;
  const double deepest = piece.box.hi.z + (piece.solid ? 0.0 : 2 * piece.flatness);
  const double rounding = 0x1p-46 * (std::abs(deepest) + plane.distance + frame_scale);
  const float depth = float_not_below(deepest + rounding);
  if (drawn != nullptr && drawn->needs_nothing(inner, depth)) return false;

  const auto first = static_cast<std::uint32_t>(out.half_planes.size());
  if (piece.box_shaped) {
    add_box_edges(views, plane, rect, out);
  } else if (!add_views(images, piece, plane, rect, out)) {
    out.half_planes.resize(first);
    return false;
  }
  out.coverages.push_back({rect.x0, rect.y0, rect.x1, rect.y1, depth, first,
                           static_cast<std::uint32_t>(out.half_planes.size()) - first});
  return true;
}

}  // namespace pvsfarm

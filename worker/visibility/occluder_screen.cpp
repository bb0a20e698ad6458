#include "worker/visibility/occluder_screen.hpp"

#include <algorithm>

#include "worker/visibility/dispatch.hpp"
#include "worker/visibility/occluder_pieces.hpp"

namespace pvsfarm {
namespace {

constexpr std::size_t kBatch = 128;

// Where boxes lie: columns of their sides in the axes of a face; z grows away from it.
struct Sides {
  const double *x0, *x1, *y0, *y1, *z_near, *z_far;
};

// The least and the largest coordinate that all four views along one axis of [lo, hi] share: a view
// moves with its viewpoint, -h or h, and shrinks with the four alphas (projection.cpp).
inline void shared(double lo, double hi, double h, const double* alpha, double& least,
                   double& most) {
  for (int face = 0; face < 2; ++face)
    for (const double v : {-h, h}) {
      const double a = alpha[2 * face], b = alpha[2 * face + 1];
      const double lo_a = v + (lo - v) * a, lo_b = v + (lo - v) * b;
      const double hi_a = v + (hi - v) * a, hi_b = v + (hi - v) * b;
      const double view_lo = lo_a < lo_b ? lo_a : lo_b, view_hi = hi_a > hi_b ? hi_a : hi_b;
      least = view_lo > least ? view_lo : least;
      most = view_hi < most ? view_hi : most;
    }
}

// What a batch may cover: the shared rectangle, and the least depth of a piece. pass is 1 where
// that holds a pixel, else 0.
struct Places {
  alignas(64) double pass[kBatch], depth[kBatch];
  alignas(64) double x0[kBatch], x1[kBatch], y0[kBatch], y1[kBatch];
};

PVSFARM_DISPATCH
void screen(const Sides& s, int n, const ProjectionPlane& plane, double nearest, Places& out) {
  const double front = plane.distance, back = front + 2 * plane.hw, sign = plane.face.sign;
  const double hu = plane.hu, hv = plane.hv, hw = plane.hw, px = plane.px, py = plane.py;
  const double left = plane.x0, right = plane.x1(), low = plane.y0, high = plane.y1();
  for (int i = 0; i < n; ++i) {
    const double z_near = sign * s.z_near[i] - hw - front, z_far = sign * s.z_far[i] - hw - front;
    const double cut = z_near > nearest ? z_near : nearest;
    const double alpha[4] = {front / (cut + front), front / (z_far + front), back / (cut + back),
                             back / (z_far + back)};
    double x0 = left, x1 = right, y0 = low, y1 = high;
    shared(s.x0[i], s.x1[i], hu, alpha, x0, x1);
    shared(s.y0[i], s.y1[i], hv, alpha, y0, y1);
    out.pass[i] = (z_far > nearest) & (x1 - x0 >= px) & (y1 - y0 >= py) ? 1 : 0;
    out.x0[i] = x0;
    out.x1[i] = x1;
    out.y0[i] = y0;
    out.y1[i] = y1;
    // Of what crosses the plane the part before it is a piece, too.
    out.depth[i] = z_near < 0 && z_far > 0 ? 0 : z_far;
  }
}

}  // namespace

void OccluderScreen::clear() {
  for (int a = 0; a < 3; ++a) {
    lo_[a].clear();
    hi_[a].clear();
  }
}

void OccluderScreen::add(const Box& local_box) {
  for (int a = 0; a < 3; ++a) {
    lo_[a].push_back(local_box.lo[a]);
    hi_[a].push_back(local_box.hi[a]);
  }
}

std::span<const OccluderScreen::Passed> OccluderScreen::pass(const ProjectionPlane& plane,
                                                             double near_m, std::size_t from) {
  passed_.clear();
  const double nearest = nearest_depth(plane, near_m);
  const int u = plane.face.u(), v = plane.face.v(), w = plane.face.axis;
  const auto& z_near = plane.face.sign > 0 ? lo_[w] : hi_[w];
  const auto& z_far = plane.face.sign > 0 ? hi_[w] : lo_[w];
  const double per_px = 1 / plane.px, per_py = 1 / plane.py;
  const int last = plane.resolution_px - 1;
  Places places;
  for (std::size_t i = from; i < size(); i += kBatch) {
    const int n = static_cast<int>(std::min(kBatch, size() - i));
    screen({&lo_[u][i], &hi_[u][i], &lo_[v][i], &hi_[v][i], &z_near[i], &z_far[i]}, n, plane,
           nearest, places);
    for (int k = 0; k < n; ++k) {
      if (places.pass[k] == 0) continue;
      passed_.push_back({static_cast<std::uint32_t>(i + k),
                         static_cast<float>(places.depth[k]),
                         {static_cast<int>((places.x0[k] - plane.x0) * per_px),
                          static_cast<int>((places.y0[k] - plane.y0) * per_py),
                          std::min(static_cast<int>((places.x1[k] - plane.x0) * per_px), last),
                          std::min(static_cast<int>((places.y1[k] - plane.y0) * per_py), last)}});
    }
  }
  return passed_;
}

}  // namespace pvsfarm

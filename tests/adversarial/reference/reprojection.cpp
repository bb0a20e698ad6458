#include "tests/adversarial/reference/reprojection.hpp"

#include <algorithm>
#include <cmath>

#include "common/geometry/rounding.hpp"

namespace pvsfarm::reference {

Footprint footprint(const ProjectionPlane& from, const ProjectionPlane& to, int axis, double lo,
                    double hi) {
  const double half = axis == 0 ? to.hu : to.hv;
  Footprint f{HUGE_VAL, -HUGE_VAL};
  for (const double behind : {0.0, 2 * to.hw})
    for (const double v : {-half, half})
      for (const double p : {lo, hi}) {
        const double at = v + (p - v) * ((from.distance + behind) / (to.distance + behind));
        f.lo = std::min(f.lo, at);
        f.hi = std::max(f.hi, at);
      }
  return f;
}

void reproject(const OcclusionMap& from, OcclusionMap& to, Depth depth) {
  const ProjectionPlane &near = from.plane(), &far = to.plane();
  const int n = near.resolution_px;
  // The pixels of the first plane that a row or column of the second needs; none: outside.
  struct Range {
    int first = 0, past = 0;
  };
  const auto range = [&](int axis, int pixel) {
    const double x0 = axis == 0 ? far.x0 : far.y0, px = axis == 0 ? far.px : far.py;
    const Footprint f = footprint(near, far, axis, x0 + pixel * px, x0 + (pixel + 1) * px);
    const double from0 = axis == 0 ? near.x0 : near.y0, from_px = axis == 0 ? near.px : near.py;
    const double lo = std::floor((f.lo - from0) / from_px - 1e-9);
    const double hi = std::floor((f.hi - from0) / from_px + 1e-9) + 1;
    return lo < 0 || hi > n ? Range{} : Range{static_cast<int>(lo), static_cast<int>(hi)};
  };
  for (int j = 0; j < far.resolution_px; ++j)
    for (int i = 0; i < far.resolution_px; ++i) {
      const Range x = range(0, i), y = range(1, j);
      float deepest = x.past == 0 || y.past == 0 ? kUncovered : -kUncovered;
      for (int v = y.first; v < y.past && x.past > 0; ++v)
        for (int u = x.first; u < x.past; ++u) deepest = std::max(deepest, from.base()[v * n + u]);
      if (deepest == kUncovered) continue;
      const double z = depth == Depth::kKept ? static_cast<double>(deepest) : 0;
      to.base()[j * far.resolution_px + i] =
          float_not_below(z + near.distance - far.distance + 1e-9);
    }
}

double spacing(const Spacing& s) {
  return s.distance * (s.kernel_px - 1) * s.plane_width / (s.cell_width * s.resolution_px);
}

double spacing_as_printed(const Spacing& s) {
  return s.distance * (s.kernel_px - 1) * s.plane_width / s.cell_width;
}

double kernel_px(const Spacing& s, double apart) {
  return s.cell_width * apart / s.distance / (s.plane_width / s.resolution_px);
}

namespace {

// Half the side, along one axis, of the rectangle on the front face's plane that every ray from the
// cell to [-reach, reach] at distance `far` crosses.
double equivalent_half(double half, double reach, double depth, double far) {
  return std::max(half, half + (reach - half) * depth / (far + depth));
}

}  // namespace

std::optional<OcclusionMap> convolve(const OcclusionMap& from, int kernel_px) {
  const ProjectionPlane& near = from.plane();
  const int n = near.resolution_px;
  // The wider of the two axes' kernels says how far; the equivalent cell grows with the plane, so
  // the distance is found by bisection.
  const auto kernel = [&](double far) {
    const double scale = far / near.distance;
    const double x = equivalent_half(near.hu, -near.x0 * scale, 2 * near.hw, far);
    const double y = equivalent_half(near.hv, -near.y0 * scale, 2 * near.hw, far);
    const double apart = (far - near.distance) / far;  // on the first plane
    return std::max(2 * x * apart / near.px, 2 * y * apart / near.py);
  };
  double lo = near.distance, hi = 100 * near.distance;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (lo + hi);
    (kernel(middle) < kernel_px - 1 - 1e-6 ? lo : hi) = middle;
  }
  if (!(lo > near.distance)) return std::nullopt;
  ProjectionPlane far = near;
  far.distance = lo;
  for (double* v : {&far.x0, &far.y0, &far.px, &far.py}) *v *= lo / near.distance;
  OcclusionMap to;
  to.reset(far);
  const int reach = kernel_px / 2;
  for (int j = reach; j + reach < n; ++j)
    for (int i = reach; i + reach < n; ++i) {
      float deepest = -kUncovered;
      for (int v = j - reach; v <= j + reach; ++v)
        for (int u = i - reach; u <= i + reach; ++u)
          deepest = std::max(deepest, from.base()[v * n + u]);
      if (deepest == kUncovered) continue;
      to.base()[j * n + i] =
          float_not_below(static_cast<double>(deepest) + near.distance - lo + 1e-9);
    }
  return to;
}

}  // namespace pvsfarm::reference

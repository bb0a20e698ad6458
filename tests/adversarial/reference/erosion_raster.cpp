#include "tests/adversarial/reference/erosion_raster.hpp"

#include <algorithm>
#include <cmath>

namespace pvsfarm::reference {
namespace {

constexpr double kMargin = 1e-9;

// What is seen from the eye, in pixels; the view holds the slopes [-1, 1] squared.
struct PixelBounds {
  double lo[2], hi[2];
};
// Pixels first <= i < past along one axis, of the interval [lo, hi] in pixels.
struct Range {
  int first, past;
};
int to_pixel(double x) { return static_cast<int>(std::clamp(x, -1e6, 1e6)); }
Range with_middle_in(double lo, double hi) {
  return {to_pixel(std::ceil(lo - 0.5)), to_pixel(std::floor(hi + 0.5))};
}
Range wholly_in(double lo, double hi) {
  return {to_pixel(std::ceil(lo + kMargin)), to_pixel(std::floor(hi - kMargin))};
}
Range touched_by(double lo, double hi) {
  return {to_pixel(std::floor(lo - kMargin)), to_pixel(std::floor(hi + kMargin)) + 1};
}

// Where segments from the cell to the occludee cross the plane of the face.
Box gate_of(const Box& cell, const Box& occludee) {
  Box gate{{0, 0, cell.hi.z}, {0, 0, cell.hi.z}};
  for (int axis = 0; axis < 2; ++axis) {
    gate.lo[axis] = cell.lo[axis];
    gate.hi[axis] = cell.hi[axis];
    for (const double vx : {cell.lo[axis], cell.hi[axis]})
      for (const double mx : {occludee.lo[axis], occludee.hi[axis]})
        for (const double mz : {occludee.lo.z, occludee.hi.z}) {
          const double x = vx + (mx - vx) * (cell.hi.z - cell.lo.z) / (mz - cell.lo.z);
          gate.lo[axis] = std::min(gate.lo[axis], x - kMargin);
          gate.hi[axis] = std::max(gate.hi[axis], x + kMargin);
        }
  }
  return gate;
}

class View {
 public:
  View(const Vec3& eye, int resolution_px)
      : eye_(eye), side_(resolution_px), depth_(side_ * side_, HUGE_VAL) {}

  // The near face of an occluder.
  void draw(const Box& box, Sampling sampling) {
    const Box face{box.lo, {box.hi.x, box.hi.y, box.lo.z}};
    const PixelBounds r = project(face);
    const auto range = sampling == Sampling::kConservative ? wholly_in : with_middle_in;
    visit(range(r.lo[0], r.hi[0]), range(r.lo[1], r.hi[1]), [&](double& depth) {
      depth = std::min(depth, box.lo.z);
      return true;
    });
  }

  bool hidden(const Box& box, Sampling sampling) {
    const PixelBounds r = project(box);
    for (int axis = 0; axis < 2; ++axis)
      if (r.lo[axis] < 0 || r.hi[axis] > side_) return false;  // not all of it in this view
    const auto range = sampling == Sampling::kConservative ? touched_by : with_middle_in;
    return visit(range(r.lo[0], r.hi[0]), range(r.lo[1], r.hi[1]),
                 [&](const double& depth) { return depth < box.lo.z; });
  }

 private:
  PixelBounds project(const Box& box) const {
    PixelBounds r{{HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL}};
    for (int k = 0; k < 8; ++k)
      for (int axis = 0; axis < 2; ++axis) {
        const Vec3 p = box.corner(k) - eye_;
        const double at = (p[axis] / p.z + 1) / 2 * side_;
        r.lo[axis] = std::min(r.lo[axis], at);
        r.hi[axis] = std::max(r.hi[axis], at);
      }
    return r;
  }

  // Whether `per_pixel` is true of all pixels of the view in both ranges.
  template <class PerPixel>
  bool visit(Range x, Range y, PerPixel&& per_pixel) {
    for (int j = std::max(0, y.first); j < std::min(side_, y.past); ++j)
      for (int i = std::max(0, x.first); i < std::min(side_, x.past); ++i)
        if (!per_pixel(depth_[j * side_ + i])) return false;
    return true;
  }

  Vec3 eye_;
  int side_;
  std::vector<double> depth_;  // of the nearest occluder; infinite: none
};

}  // namespace

bool hides_by_raster(const RasterQuery& query, Sampling sampling) {
  if (!(query.occludee.lo.z > query.cell.hi.z)) return false;
  const Box gate = gate_of(query.cell, query.occludee);
  const Vec3 eye = gate.center(), half = gate.size() * 0.5;
  View view(eye, query.resolution_px);
  for (const Box& box : query.boxes) {
    const Box eroded{box.lo + half, box.hi - half};
    if (!eroded.empty() && eroded.lo.z > eye.z) view.draw(eroded, sampling);
  }
  // O lies in R + X.
  Box shrunk{query.occludee.lo + half, query.occludee.hi - half};
  for (int axis = 0; axis < 2; ++axis)
    if (shrunk.lo[axis] > shrunk.hi[axis])
      shrunk.lo[axis] = shrunk.hi[axis] = query.occludee.center()[axis];
  return view.hidden(shrunk, sampling);
}

}  // namespace pvsfarm::reference

#include "worker/evaluator/sweep_choice.hpp"

#include <algorithm>
#include <cmath>

namespace pvsfarm {
namespace {

constexpr double kMostNarrow = 0.9;

// Shortest first.
std::array<double, 3> sides_of(const Box& box) {
  const Vec3 size = box.size();
  std::array<double, 3> sides{size.x, size.y, size.z};
  std::sort(sides.begin(), sides.end());
  return sides;
}

}  // namespace

// frexp and a multiplication: exact, the same everywhere.
int OccluderWidths::bucket(double width) {
  int exponent = 0;
  const double mantissa = std::frexp(width, &exponent);  // 0.5 .. 1
  const int octave = std::clamp(exponent + kOctaves / 2, 0, kOctaves - 1);
  return octave * kSteps + static_cast<int>((mantissa - 0.5) * 2 * kSteps);
}

void OccluderWidths::add(const Box& box, double area) {
  const double width = sides_of(box)[1];
  if (width > 0) area_[bucket(width)] += area;
}

OccluderWidths OccluderWidths::of_pieces(const Scene& scene) {
  OccluderWidths widths;
  for (const Occluder& occluder : scene.occluders()) {
    const auto sides = sides_of(occluder.box);
    if (occluder.face_of < 0) widths.add(occluder.box, sides[1] * sides[2]);
  }
  return widths;
}

OccluderWidths OccluderWidths::of_surfaces(const Scene& scene) {
  OccluderWidths widths;
  for (const SurfaceComponent& surface : scene.surface_components())
    widths.add(surface.box, surface.area);
  return widths;
}

double OccluderWidths::share_narrower_than(double width) const {
  if (!(width > 0)) return 0;
  const int end = bucket(width);
  double narrower = 0, all = 0;
  for (int i = 0; i < kSteps * kOctaves; ++i) {
    all += area_[i];
    if (i < end) narrower += area_[i];
  }
  return all > 0 ? narrower / all : 0;
}

bool all_narrow(const OccluderWidths& widths, const Cell& cell) {
  const Vec3 size = cell.hi - cell.lo;
  return widths.share_narrower_than(std::max(size.x, size.y)) >= kMostNarrow;
}

}  // namespace pvsfarm

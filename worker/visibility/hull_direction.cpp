#include "worker/visibility/hull_direction.hpp"

#include <algorithm>

namespace pvsfarm {
namespace {
constexpr int kSteps = 16;
}

Vec3 toward_hull(std::span<const Vec3> points, const Vec3& eye) {
  Vec3 toward = points[0] - eye;
  for (int step = 0; step < kSteps; ++step) {
    Vec3 way{0};
    double least = 0;
    for (const Vec3& p : points) {
      const Vec3 change = p - eye - toward;
      if (dot(toward, change) >= least) continue;
      least = dot(toward, change);
      way = change;
    }
    if (!(least < 0)) break;
    toward += way * std::min(1.0, -least / dot(way, way));
  }
  return toward;
}

}  // namespace pvsfarm

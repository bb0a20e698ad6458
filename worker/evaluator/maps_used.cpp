#include "worker/evaluator/maps_used.hpp"

#include <algorithm>
#include <cmath>

namespace pvsfarm {

void add_plane(const ProjectionPlane& plane, MapsUsed& maps) {
  const auto distance = static_cast<float>(plane.distance);
  const double along =
      std::max(std::abs(plane.x0), std::abs(plane.x1())) / (plane.hu + plane.distance);
  const double across =
      std::max(std::abs(plane.y0), std::abs(plane.y1())) / (plane.hv + plane.distance);
  maps.nearest_m = maps.planes == 0 ? distance : std::min(maps.nearest_m, distance);
  maps.farthest_m = std::max(maps.farthest_m, distance);
  maps.extent = std::max(maps.extent, static_cast<float>(std::max(along, across)));
  maps.resolution_px =
      std::max(maps.resolution_px, static_cast<std::uint32_t>(plane.resolution_px));
  ++maps.planes;
}

}  // namespace pvsfarm

#include "worker/visibility/plane_choice.hpp"

#include <algorithm>
#include <cmath>

#include "worker/visibility/occludee_test.hpp"

namespace pvsfarm {
namespace {

constexpr std::size_t kRankedForPlanes = 192;  // the largest occluders decide
constexpr double kReuse = 0.35;                // a plane serves occluders within this ln-distance

// An occluder as the choice sees it: where it ends beyond the face, and how much it weighs.
struct Wall {
  double end;     // [units] distance of its far side beyond the face
  double weight;  // solid angle
  double served = 0;
};

std::vector<Wall> walls_beyond(const CellFrame& frame, const LocalOccluders& occluders, Face face) {
  std::vector<Wall> walls;
  const double hw = frame.half()[face.axis];
  const std::size_t count = std::min(occluders.list.size(), kRankedForPlanes);
  for (std::size_t i = 0; i < count; ++i) {
    const Box& box = occluders.list[i].box;
    const double a = face.sign * box.lo[face.axis], b = face.sign * box.hi[face.axis];
    const double from = std::min(a, b) - hw, to = std::max(a, b) - hw;
    if (!(to > 0)) continue;
    // What lies off to the side of this face is the business of another.
    double aside = HUGE_VAL;
    for (const int axis : {face.u(), face.v()}) {
      const double gap =
          std::max({0.0, box.lo[axis] - frame.half()[axis], -box.hi[axis] - frame.half()[axis]});
      aside = aside == HUGE_VAL ? gap : std::max(aside, gap);
    }
    if (aside > 1.5 * to) continue;
    walls.push_back({std::max(to, 1e-9), occluders.list[i].solid_angle});
    if (from > 0 && to > 1.5 * from) walls.push_back({from, occluders.list[i].solid_angle * 0.5});
  }
  return walls;
}

double service(double end, double distance) {
  const double t = std::log(distance / end) / kReuse;
  return std::exp(-t * t);
}

// Greedy: again and again the distance that serves most weight not yet served.
std::vector<double> choose_distances(std::vector<Wall> walls, int count) {
  std::vector<double> chosen;
  while (static_cast<int>(chosen.size()) < count) {
    double best = 0, best_gain = 0;
    for (const Wall& candidate : walls) {
      double gain = 0;
      for (const Wall& wall : walls)
        gain += wall.weight * std::max(0.0, service(wall.end, candidate.end) - wall.served);
      if (gain > best_gain) {
        best_gain = gain;
        best = candidate.end;
      }
    }
    if (best_gain <= 0) break;
    for (Wall& wall : walls) wall.served = std::max(wall.served, service(wall.end, best));
    chosen.push_back(best);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

// Shrinks the rectangle to where Projections of what lies behind the plane can fall.
void fit_rectangle(ProjectionPlane& plane, const Box& occludees) {
  Box behind = plane.plane_from_local(occludees);
  behind.lo.z = std::max(behind.lo.z, 0.0);
  if (behind.empty()) return;
  const PlaneRect rect = occludee_rect(plane, behind);
  const double x1 = plane.x1(), y1 = plane.y1();
  const double margin_x = 2 * plane.px, margin_y = 2 * plane.py;
  const double left = std::max(plane.x0, rect.x0 - margin_x),
               right = std::min(x1, rect.x1 + margin_x);
  const double low = std::max(plane.y0, rect.y0 - margin_y),
               high = std::min(y1, rect.y1 + margin_y);
  if (!(left < right) || !(low < high)) return;
  plane.x0 = left;
  plane.px = (right - left) / plane.resolution_px;
  plane.y0 = low;
  plane.py = (high - low) / plane.resolution_px;
}

}  // namespace

std::vector<ProjectionPlane> choose_planes(const CellFrame& frame, const LocalOccluders& occluders,
                                           const PlaneRequest& request) {
  std::vector<ProjectionPlane> planes;
  for (const Face face : kFaces) {
    const double hw = frame.half()[face.axis];
    const double reach = std::max(face.sign * request.occludees.lo[face.axis],
                                  face.sign * request.occludees.hi[face.axis]) -
                         hw;
    if (!(reach > 0)) continue;
    const auto walls = walls_beyond(frame, occluders, face);
    for (const double distance : choose_distances(walls, request.planes_per_face)) {
      if (!(distance < reach) || !std::isfinite(distance)) continue;
      ProjectionPlane plane =
          square_plane(frame, face, distance, request.extent, request.resolution_px);
      fit_rectangle(plane, request.occludees);
      planes.push_back(plane);
    }
  }
  return planes;
}

}  // namespace pvsfarm

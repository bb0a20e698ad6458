#include "worker/visibility/plane_choice.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "worker/visibility/occludee_test.hpp"

namespace pvsfarm {
namespace {

constexpr std::size_t kRankedForPlanes =
    64;                              // the largest occluders say where the first plane goes
constexpr double kFirstShare = 0.1;  // of their weight ends before it
constexpr double kLastShare = 0.6;   // of the way to the farthest occludee: the last plane
constexpr double kAskewShare = 0.3;  // of that way: the first plane where no wall says where
// The step from plane to plane is the smallest of these that spans the way. Written out, so that no
// library's idea of a root can differ from machine to machine.
constexpr double kLeastDistance = 1e-6;  // for cells without extent
constexpr double kSteps[] = {1.25, 1.4, 1.6, 1.8, 2.0, 2.3, 2.6, 3.0};

struct Wall {
  double end;     // distance of its far side beyond the face
  double weight;  // solid angle
};

// The largest occluders that lie before this face rather than off to its side.
std::vector<Wall> walls_beyond(const CellFrame& frame, const LocalOccluders& occluders, Face face) {
  std::vector<Wall> walls;
  const Vec3 half = frame.half();
  for (const LocalOccluder& occluder : occluders.list) {
    const Box& box = occluder.box;
    const double end =
        std::max(face.sign * box.lo[face.axis], face.sign * box.hi[face.axis]) - half[face.axis];
    double aside = 0;
    for (const int axis : {face.u(), face.v()})
      aside = std::max({aside, box.lo[axis] - half[axis], -box.hi[axis] - half[axis]});
    if (!(end > 0) || aside > end) continue;
    walls.push_back({end, occluder.solid_angle});
    if (walls.size() == kRankedForPlanes) break;
  }
  return walls;
}

// Where the nearest of the large occluders end.
double first_distance(std::vector<Wall>& walls) {
  std::sort(walls.begin(), walls.end(), [](const Wall& a, const Wall& b) {
    return a.end < b.end || (a.end == b.end && a.weight < b.weight);
  });
  double total = 0, passed = 0;
  for (const Wall& wall : walls) total += wall.weight;
  for (const Wall& wall : walls) {
    passed += wall.weight;
    if (passed >= kFirstShare * total) return wall.end;
  }
  return walls.back().end;
}

bool looks_down(const CellFrame& frame, Face face) {
  return face.sign * frame.axes()[face.axis].z < -0.5;
}

double least_distance(const CellFrame& frame, Face face) {
  return std::max({frame.half()[face.u()], frame.half()[face.v()], kLeastDistance});
}

double step_for(double first, double last, int count) {
  for (const double step : kSteps) {
    double at = first;
    for (int i = 1; i < count; ++i) at *= step;
    if (at >= last) return step;
  }
  return std::end(kSteps)[-1];
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

OccludeeExtent extent_of(const Scene& scene, const CellFrame& frame, const VisibleSet& open) {
  OccludeeExtent extent;
  open.for_each([&](ObjectId id) {
    const Box box = frame.local_around_world(scene.object(id).box);
    extent.around.add(box);
    extent.highest_lo = glm::max(extent.highest_lo, box.lo);
    extent.lowest_hi = glm::min(extent.lowest_hi, box.hi);
  });
  return extent;
}

std::vector<ProjectionPlane> choose_planes(const CellFrame& frame, const LocalOccluders& occluders,
                                           const PlaneRequest& request) {
  std::vector<ProjectionPlane> planes;
  for (const Face face : kFaces) {
    const double hw = frame.half()[face.axis];
    const bool up = face.sign > 0;
    // No object lies strictly beyond the face: rule P could hide none.
    const OccludeeExtent& extent = request.occludees;
    const double nearest_side = up ? extent.highest_lo[face.axis] : -extent.lowest_hi[face.axis];
    if (!(nearest_side > hw)) continue;
    const double reach = (up ? extent.around.hi[face.axis] : -extent.around.lo[face.axis]) - hw;
    auto walls = walls_beyond(frame, occluders, face);
    if (walls.empty()) continue;
    // No nearer than the cell is wide, lest a car at the kerb take all planes to itself.
    double first = std::max(first_distance(walls), least_distance(frame, face));
    // Walls askew may end beyond all there is to hide: their ends say nothing. Downwards all solids
    // on the ground do, and nothing stands below it.
    if (first >= reach && !looks_down(frame, face)) first = kAskewShare * reach;
    const double last = std::max(first, kLastShare * reach);
    const double step = step_for(first, last, request.planes_per_face);
    double distance = first;
    for (int i = 0; i < request.planes_per_face; ++i, distance *= step) {
      if (!(distance < reach) || (i > 0 && distance > last * step)) break;
      ProjectionPlane plane =
          square_plane(frame, face, distance, request.extent, request.resolution_px);
      fit_rectangle(plane, extent.around);
      planes.push_back(plane);
    }
  }
  return planes;
}

namespace {

constexpr std::size_t kAimedObjects = 128;  // of the open ones, evenly along the hierarchy
constexpr std::size_t kBlockersEach = 8;    // the largest on the way
constexpr double kNear = 0.7;    // a plane this much nearer or farther than an end is of no use
constexpr double kApart = 0.97;  // candidates closer to each other are one

// That an occluder on the way to an open object ends so far beyond a face.
struct End {
  std::size_t face;
  double distance;
  double weight;      // of the object
  double served = 0;  // 0 .. 1: how near planes are already
};

// 1 for a plane at the end of a blocker, falling to 0; before the end the part behind is lost.
double use_of(double plane, double end) {
  const double ratio = plane < end ? plane / end : end / plane;
  const double use = std::max(0.0, (ratio - kNear) / (1 - kNear));
  return plane < end ? 0.5 * use : use;
}

// Whether the segment from 0 to `to` meets the box.
bool crosses(const Box& box, const Vec3& to) {
  double enter = 0, leave = 1;
  for (int a = 0; a < 3; ++a) {
    if (to[a] == 0) {
      if (box.lo[a] > 0 || box.hi[a] < 0) return false;
      continue;
    }
    const double t0 = box.lo[a] / to[a], t1 = box.hi[a] / to[a];
    enter = std::max(enter, std::min(t0, t1));
    leave = std::min(leave, std::max(t0, t1));
  }
  return enter <= leave;
}

// How far the near or the far side of the box lies beyond a face.
double beyond(const Box& box, const CellFrame& frame, Face face, bool far_side) {
  const bool high = (face.sign > 0) == far_side;
  return face.sign * (high ? box.hi : box.lo)[face.axis] - frame.half()[face.axis];
}

// Of the face that the object lies farthest beyond.
void add_ends(const Box& object, double weight, const CellFrame& frame,
              const LocalOccluders& occluders, std::vector<End>& ends) {
  std::size_t best = 0;
  double most = 0;
  for (std::size_t f = 0; f < kFaces.size(); ++f) {
    const double distance = beyond(object, frame, kFaces[f], false);
    if (distance > most) most = distance, best = f;
  }
  if (!(most > 0)) return;
  std::size_t found = 0;
  const Vec3 to = object.center();
  for (const LocalOccluder& occluder : occluders.list) {
    if (!crosses(occluder.box, to)) continue;
    const double end = beyond(occluder.box, frame, kFaces[best], true);
    if (!(end > 0) || beyond(occluder.box, frame, kFaces[best], false) >= most) continue;
    ends.push_back({best, std::min(end, most), weight});
    if (++found == kBlockersEach) return;
  }
}

}  // namespace

std::vector<ProjectionPlane> aim_planes(const Scene& scene, const CellFrame& frame,
                                        const LocalOccluders& occluders, const VisibleSet& open,
                                        const AimRequest& request) {
  // 1. Where the blockers of a sample of what is open end.
  std::vector<End> ends;
  const std::size_t stride = open.count() / kAimedObjects + 1;
  std::size_t number = 0;
  open.for_each([&](ObjectId id) {
    if (number++ % stride != stride / 2) return;
    add_ends(frame.local_around_world(scene.object(id).box),
             static_cast<double>(scene.object(id).triangle_count), frame, occluders, ends);
  });
  for (End& end : ends)
    for (const ProjectionPlane& plane : request.before)
      if (plane.face.axis == kFaces[end.face].axis && plane.face.sign == kFaces[end.face].sign)
        end.served = std::max(end.served, use_of(plane.distance, end.distance));

  // 2. The places to choose from.
  std::vector<End> places = ends;
  std::sort(places.begin(), places.end(), [](const End& a, const End& b) {
    return a.face < b.face || (a.face == b.face && a.distance > b.distance);
  });
  std::vector<End> apart;
  for (const End& place : places)
    if (apart.empty() || apart.back().face != place.face ||
        place.distance < kApart * apart.back().distance)
      apart.push_back(place);

  // 3. The best of them, one after the other.
  const OccludeeExtent extent = extent_of(scene, frame, open);
  std::vector<ProjectionPlane> planes;
  while (planes.size() < request.planes) {
    const End* best = nullptr;
    double most = 0;
    for (const End& place : apart) {
      double gain = 0;
      for (const End& end : ends)
        if (end.face == place.face)
          gain += end.weight * std::max(0.0, use_of(place.distance, end.distance) - end.served);
      if (gain > most) most = gain, best = &place;
    }
    if (best == nullptr) break;
    for (End& end : ends)
      if (end.face == best->face)
        end.served = std::max(end.served, use_of(best->distance, end.distance));
    planes.push_back(square_plane(frame, kFaces[best->face], best->distance, request.extent,
                                  request.resolution_px));
    fit_rectangle(planes.back(), extent.around);
  }
  // Planes of one face together: boxes are tested on all of them at once.
  std::stable_sort(
      planes.begin(), planes.end(), [](const ProjectionPlane& a, const ProjectionPlane& b) {
        return std::pair(a.face.axis, a.face.sign) < std::pair(b.face.axis, b.face.sign);
      });
  return planes;
}

}  // namespace pvsfarm

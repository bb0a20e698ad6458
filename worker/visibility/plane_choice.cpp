#include "worker/visibility/plane_choice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

#include "worker/visibility/dispatch.hpp"
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
constexpr double kNear = 0.7;  // a plane this much nearer or farther than an end is of no use
constexpr std::size_t kBatch = 256;
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

// The sides of the occluders' boxes in columns.
struct Sides {
  std::array<std::vector<double>, 3> lo, hi;
  explicit Sides(const LocalOccluders& occluders) {
    for (int a = 0; a < 3; ++a)
      for (const LocalOccluder& occluder : occluders.list) {
        lo[a].push_back(occluder.box.lo[a]);
        hi[a].push_back(occluder.box.hi[a]);
      }
  }
};

// meets[i]: whether the segment from 0 to 1 / `per` meets box i. Where a coordinate is 0, `per` is
// infinite, and a box that has 0 for a side gives NaN: taken as not met.
PVSFARM_DISPATCH
void find_met(const double* lo_x, const double* hi_x, const double* lo_y, const double* hi_y,
              const double* lo_z, const double* hi_z, std::size_t n, const double* per,
              double* meets) {
  const double px = per[0], py = per[1], pz = per[2];
  for (std::size_t i = 0; i < n; ++i) {
    const double xa = lo_x[i] * px, xb = hi_x[i] * px, ya = lo_y[i] * py, yb = hi_y[i] * py,
                 za = lo_z[i] * pz, zb = hi_z[i] * pz;
    const double x0 = xa < xb ? xa : xb, x1 = xa < xb ? xb : xa;
    const double y0 = ya < yb ? ya : yb, y1 = ya < yb ? yb : ya;
    const double z0 = za < zb ? za : zb, z1 = za < zb ? zb : za;
    const double xy0 = x0 > y0 ? x0 : y0, xy1 = x1 < y1 ? x1 : y1;
    const double enter = xy0 > z0 ? xy0 : z0, leave = xy1 < z1 ? xy1 : z1;
    meets[i] = (enter <= leave) & (leave >= 0) & (enter <= 1) ? 1 : 0;
  }
}

// How far the near or the far side of the box lies beyond a face.
double beyond(const Box& box, const CellFrame& frame, Face face, bool far_side) {
  const bool high = (face.sign > 0) == far_side;
  return face.sign * (high ? box.hi : box.lo)[face.axis] - frame.half()[face.axis];
}

// Of the face that the object lies farthest beyond.
void add_ends(const Box& object, double weight, const CellFrame& frame,
              const LocalOccluders& occluders, const Sides& sides, std::vector<End>& ends) {
  std::size_t best = 0;
  double most = 0;
  for (std::size_t f = 0; f < kFaces.size(); ++f) {
    const double distance = beyond(object, frame, kFaces[f], false);
    if (distance > most) most = distance, best = f;
  }
  if (!(most > 0)) return;
  const Vec3 per = 1.0 / object.center();
  double meets[kBatch];
  std::size_t found = 0;
  for (std::size_t first = 0; first < occluders.list.size(); first += kBatch) {
    const std::size_t n = std::min(kBatch, occluders.list.size() - first);
    find_met(&sides.lo[0][first], &sides.hi[0][first], &sides.lo[1][first], &sides.hi[1][first],
             &sides.lo[2][first], &sides.hi[2][first], n, &per.x, meets);
    for (std::size_t i = 0; i < n; ++i) {
      if (meets[i] == 0) continue;
      const Box& box = occluders.list[first + i].box;
      const double end = beyond(box, frame, kFaces[best], true);
      if (!(end > 0) || beyond(box, frame, kFaces[best], false) >= most) continue;
      ends.push_back({best, std::min(end, most), weight});
      if (++found == kBlockersEach) return;
    }
  }
}

// A place a plane may be put at, and what that would gain; the ends near enough to gain by it.
struct Place {
  std::size_t face;
  double distance;
  double gain = 0;
  struct Use {
    std::size_t end;
    double use;
  };
  std::vector<Use> uses;
};

void weigh(Place& place, std::span<const End> ends) {
  place.gain = 0;
  for (const Place::Use& u : place.uses)
    place.gain += ends[u.end].weight * std::max(0.0, u.use - ends[u.end].served);
}

}  // namespace

std::vector<ProjectionPlane> aim_planes(const Scene& scene, const CellFrame& frame,
                                        const LocalOccluders& occluders, const VisibleSet& open,
                                        const AimRequest& request) {
  // 1. Where the blockers of a sample of what is open end.
  std::vector<End> ends;
  const Sides sides(occluders);
  const std::size_t stride = open.count() / kAimedObjects + 1;
  std::size_t number = 0;
  open.for_each([&](ObjectId id) {
    if (number++ % stride != stride / 2) return;
    add_ends(frame.local_around_world(scene.object(id).box),
             static_cast<double>(scene.object(id).triangle_count), frame, occluders, sides, ends);
  });
  for (End& end : ends)
    for (const ProjectionPlane& plane : request.before)
      if (plane.face.axis == kFaces[end.face].axis && plane.face.sign == kFaces[end.face].sign)
        end.served = std::max(end.served, use_of(plane.distance, end.distance));

  // 2. The places to choose from.
  std::sort(ends.begin(), ends.end(), [](const End& a, const End& b) {
    return a.face < b.face || (a.face == b.face && a.distance > b.distance);
  });
  std::vector<Place> places;
  for (const End& end : ends)
    if (places.empty() || places.back().face != end.face ||
        end.distance < kApart * places.back().distance)
      places.push_back({end.face, end.distance});
  std::size_t first = 0;
  for (Place& place : places) {
    // Ends and places fall together: what is too far for this place is so for the next.
    while (ends[first].face != place.face || ends[first].distance * kNear >= place.distance)
      ++first;
    for (std::size_t e = first;
         e < ends.size() && ends[e].face == place.face && ends[e].distance > kNear * place.distance;
         ++e)
      place.uses.push_back({e, use_of(place.distance, ends[e].distance)});
    weigh(place, ends);
  }

  // 3. The best of them, one after the other.
  const OccludeeExtent extent = extent_of(scene, frame, open);
  std::vector<ProjectionPlane> planes;
  while (planes.size() < request.planes) {
    const auto best =
        std::max_element(places.begin(), places.end(),
                         [](const Place& a, const Place& b) { return a.gain < b.gain; });
    if (best == places.end() || !(best->gain > 0)) break;
    for (const Place::Use& u : best->uses) ends[u.end].served = std::max(ends[u.end].served, u.use);
    planes.push_back(square_plane(frame, kFaces[best->face], best->distance, request.extent,
                                  request.resolution_px));
    fit_rectangle(planes.back(), extent.around);
    for (Place& place : places)
      if (place.face == best->face) weigh(place, ends);
  }
  // Planes of one face together: boxes are tested on all of them at once.
  std::stable_sort(
      planes.begin(), planes.end(), [](const ProjectionPlane& a, const ProjectionPlane& b) {
        return std::pair(a.face.axis, a.face.sign) < std::pair(b.face.axis, b.face.sign);
      });
  return planes;
}

}  // namespace pvsfarm

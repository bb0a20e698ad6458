#include "worker/visibility/slice_cover.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "worker/visibility/cell_clearance.hpp"
#include "worker/visibility/occludee_test.hpp"

namespace pvsfarm {
namespace {

constexpr double kRounding = 0x1p-44;  // relative; dominates the frames' and the crossings' errors
constexpr double kMarginPx = 1e-6;     // what is so near to a contour is touched by it
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Odd places of the cell, in half extents, to look up from.
constexpr Vec3 kEyes[] = {{0.137, -0.211, 0.173}, {-0.391, 0.274, -0.119}, {0.077, 0.441, 0.323}};

double size_of(const Vec3& p) { return std::abs(p.x) + std::abs(p.y) + std::abs(p.z); }

// Whether two boxes are farther apart than `gap` along some axis.
bool apart(const Box& a, const Box& b, double gap) {
  const double margin = kRounding * (size_of(a.lo) + size_of(a.hi) + size_of(b.lo) + size_of(b.hi));
  for (int axis = 0; axis < 3; ++axis)
    if (a.lo[axis] - b.hi[axis] > gap + margin || b.lo[axis] - a.hi[axis] > gap + margin)
      return true;
  return false;
}

// Of a triangle seen from the origin, looking up: 1 if it is met and its front looks up, -1 if it
// is met from its front, 0 if it is not met, 2 for doubt.
int met_above(const Vec3& a, const Vec3& b, const Vec3& c) {
  if (std::max({a.z, b.z, c.z}) < 0) return 0;
  constexpr double kError = 0x1p-46;
  const Vec3* const corners[] = {&a, &b, &c, &a};
  int left = 0, right = 0;
  for (int k = 0; k < 3; ++k) {
    const Vec3 &p = *corners[k], &q = *corners[k + 1];
    const double turn = p.x * q.y - p.y * q.x;
    const double error = kError * (std::abs(p.x * q.y) + std::abs(p.y * q.x));
    left += turn > error ? 1 : 0;
    right += turn < -error ? 1 : 0;
  }
  if (left > 0 && right > 0) return 0;
  if (left < 3 && right < 3) return 2;
  const int front = left == 3 ? 1 : -1;
  if (std::min({a.z, b.z, c.z}) > 0) return front;
  const Vec3 bc = cross(b, c);
  const double height = front * dot(a, bc);
  const double most = std::max({size_of(a), size_of(b), size_of(c)});
  const double error = kError * 8 * most * most * most;
  if (height < -error) return 0;
  return height > error ? front : 2;
}

}  // namespace

// A plane as scan lines see it: pixels are counted along the lines, and across them.
struct SliceCover::Section {
  const ProjectionPlane& plane;
  bool along_y;      // scan lines run along the plane's y
  double tolerance;  // of any coordinate
  double margin_px;  // the same in pixels, and a little more

  Point at(const Vec3& p) const {
    const double x = (p.x - plane.x0) / plane.px, y = (p.y - plane.y0) / plane.py;
    return along_y ? Point{y, x} : Point{x, y};
  }
};

SliceCover::SliceCover(const Scene& scene)
    : scene_(scene),
      closed_(scene, SolidRule::kClosed),
      standing_(scene, SolidRule::kStanding),
      occludees_(occludee_bounds(scene)) {}

// Eyes and objects then lie in a box without a top, and what the solids lack lies outside.
bool SliceCover::use_standing(const Cell& cell) const {
  return upright_ && cell.bounds().lo.z >= scene_.ground();
}

// The signed crossings of the solid on the way up from the eye. False: doubt.
bool SliceCover::winding_above(const SliceSolid& solid, const Vec3& eye, int& winding) const {
  winding = 0;
  for (const SliceBlock& block : solids_->blocks(solid)) {
    if (block.box.lo.x > eye.x || block.box.hi.x < eye.x || block.box.lo.y > eye.y ||
        block.box.hi.y < eye.y || block.box.hi.z < eye.z)
      continue;
    for (const SliceTriangle& triangle : solids_->triangles(block)) {
      const auto& v = scene_.surface_triangles()[triangle.index].vertex;
      const auto vertices = scene_.surface_vertices();
      const int met = met_above(vertices[v[0]] - eye, vertices[v[1]] - eye, vertices[v[2]] - eye);
      if (met == 2) return false;
      winding += triangle.turn * met;
    }
  }
  return true;
}

// How often the solid winds around the cell. False: the cell may touch it, or doubt.
bool SliceCover::find_winding(const SliceSolid& solid, const Cell& cell, double near_m,
                              int& winding) const {
  const Box bounds = frame_->world_bounds();
  winding = 0;
  if (apart(solid.box, bounds, near_m)) {
    // Nothing of it above the cell, which is outside.
    if (solid.box.lo.x > bounds.hi.x || solid.box.hi.x < bounds.lo.x ||
        solid.box.lo.y > bounds.hi.y || solid.box.hi.y < bounds.lo.y ||
        solid.box.hi.z < bounds.lo.z)
      return true;
  }
  for (const SliceBlock& block : solids_->blocks(solid)) {
    if (apart(block.box, bounds, near_m)) continue;
    for (const SliceTriangle& triangle : solids_->triangles(block)) {
      CornersAtCell corners;
      unsigned beyond = ~0u;
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t v = scene_.surface_triangles()[triangle.index].vertex[k];
        corners.world[k] = scene_.surface_vertices()[v];
        corners.local[k] = frame_->local_from_world(corners.world[k]);
        beyond &= beyond_faces(corners.world[k], corners.local[k], cell, *frame_);
      }
      if (near_cell(corners, *frame_, near_m)) return false;
      if (beyond == 0 && side_of_cell(corners, cell, *frame_) == 0) return false;
    }
  }
  const Vec3 middle = cell.lo * 0.5 + cell.hi * 0.5, half = cell.half();
  for (const Vec3& at : kEyes)
    if (winding_above(solid, cell.point(middle + at * half), winding)) return true;
  return false;
}

void SliceCover::begin(const Cell& cell, const CellFrame& frame, double near_m) {
  frame_ = &frame;
  upright_ = frame.axes()[2] == Vec3(0, 0, 1);
  const bool standing = use_standing(cell);
  solids_ = standing ? &standing_ : &closed_;
  const Box bounds = cell.bounds();
  const bool between_sides = frame.aligned() && bounds.lo.x >= occludees_.lo.x &&
                             bounds.hi.x <= occludees_.hi.x && bounds.lo.y >= occludees_.lo.y &&
                             bounds.hi.y <= occludees_.hi.y;
  used_.clear();
  largest_ = 0;
  for (const SliceSolid& solid : solids_->solids()) {
    if (solid.at_sides && !between_sides) continue;
    int winding = 0;
    if (!find_winding(solid, cell, near_m, winding)) continue;
    used_.push_back({&solid, frame.local_around_world(solid.box), winding});
    largest_ = std::max({largest_, size_of(used_.back().local.lo), size_of(used_.back().local.hi)});
  }
}

// The pixels that may lie in the slice, as far as the map goes.
SliceCover::Window SliceCover::window_of(const Used& used, const Section& section,
                                         const OcclusionMap& map) const {
  const ProjectionPlane& plane = section.plane;
  const int side = plane.resolution_px;
  Box box = plane.plane_from_local(used.local);
  const auto clamped = [side](double at) {
    return static_cast<int>(std::clamp(at, -1.0, static_cast<double>(side) + 1));
  };
  const Point lo = section.at(box.lo), hi = section.at(box.hi);
  Window window{clamped(lo.along) - 1, clamped(hi.along) + 2, clamped(lo.across) - 1,
                clamped(hi.across) + 2};
  // What winds around the cell, or has no bottom, has an inside beyond its box.
  if (used.winding != 0 || !used.solid->closed()) window.first_along = 0;
  if (used.winding != 0) window = {0, side, 0, side};
  if (used.solid->at_sides) {
    // Pixels that cross a side of all occludees would have a border within them.
    const Box all = plane.plane_from_local(frame_->local_around_world(occludees_));
    window.first_across = clamped(std::ceil(section.at(all.lo).across + section.margin_px));
    window.end_across = clamped(std::floor(section.at(all.hi).across - section.margin_px));
  }
  window.first_along = std::max(window.first_along, 0);
  window.first_across = std::max(window.first_across, 0);
  window.end_along = std::min(window.end_along, side);
  window.end_across = std::min(window.end_across, side);
  if (window.empty()) return window;
  PixelRange range{window.first_along, window.first_across, window.end_along - 1,
                   window.end_across - 1};
  if (section.along_y) {
    std::swap(range.i0, range.j0);
    std::swap(range.i1, range.j1);
  }
  if (map.covered(range, std::numeric_limits<float>::min())) window.end_along = window.first_along;
  return window;
}

// Whether the slice can be told from what lies outside on this plane, and what for.
bool SliceCover::serves(const Used& used, const Section& section) const {
  const ProjectionPlane& plane = section.plane;
  const Box box = plane.plane_from_local(used.local);
  const bool cut = box.lo.z <= section.tolerance && box.hi.z >= -section.tolerance;
  if (!cut && used.winding == 0) return false;
  if (used.solid->closed() || plane.face.axis != 2) return true;
  // Scan lines that do not go up must lie above all border.
  const double ground = frame_->local_from_world({0, 0, scene_.ground()}).z;
  const double height = plane.face.sign * (plane.hw + plane.distance);
  return !used.solid->at_sides && height > ground + section.tolerance;
}

SliceWork SliceCover::draw(OcclusionMap& map) {
  work_ = {};
  const ProjectionPlane& plane = map.plane();
  const double scale =
      frame_->offset_scale() + largest_ + plane.hu + plane.hv + 2 * plane.hw + plane.distance;
  const double tolerance = kRounding * scale;
  const Section section{plane, upright_ && plane.face.axis == 0, tolerance,
                        kMarginPx + 4 * tolerance / std::min(plane.px, plane.py)};
  for (const Used& used : used_) {
    if (!serves(used, section)) continue;
    const Window window = window_of(used, section, map);
    if (window.empty()) continue;
    const std::size_t pixels = static_cast<std::size_t>(window.size()) *
                               static_cast<std::size_t>(window.end_across - window.first_across);
    if (steps_.size() < pixels) {
      steps_.resize(pixels, 0);
      touched_.resize(pixels, 0);
    }
    add_contour(used, section, window);
    fill(used, section, window, map);
  }
  if (work_.pixels > 0) map.build_pyramids();
  return work_;
}

void SliceCover::add_contour(const Used& used, const Section& section, const Window& window) {
  for (const SliceBlock& block : solids_->blocks(*used.solid)) {
    const Box box = section.plane.plane_from_local(frame_->local_around_world(block.box));
    if (!(box.lo.z <= section.tolerance && box.hi.z >= -section.tolerance)) continue;
    for (const SliceTriangle& triangle : solids_->triangles(block))
      add_triangle(triangle, section, window);
  }
}

// Marks what the triangle touches near the plane, and counts where scan lines cross it.
void SliceCover::add_triangle(const SliceTriangle& triangle, const Section& section,
                              const Window& window) {
  const double tolerance = section.tolerance;
  std::array<Vec3, 3> v;
  for (int k = 0; k < 3; ++k)
    v[k] = section.plane.plane_from_local(frame_->local_from_world(
        scene_.surface_vertices()[scene_.surface_triangles()[triangle.index].vertex[k]]));
  const auto [low, high] = std::minmax({v[0].z, v[1].z, v[2].z});
  if (!(low <= tolerance && high >= -tolerance)) return;

  // 1. The oriented contour. A vertex on the plane counts as beyond it: neighbours agree.
  std::array<Point, 2> ends{};  // where the plane is passed on the way beyond it, and back
  int crossings = 0;
  double stretch = 0;  // how far, in pixels, the part within the rounding of the plane goes on
  for (int k = 0; k < 3; ++k) {
    const Vec3 &p = v[k], &q = v[(k + 1) % 3];
    if ((p.z < 0) == (q.z < 0)) continue;
    const Vec3 &a = p.z < 0 ? p : q, &b = p.z < 0 ? q : p;
    const Vec3 slope = (b - a) / (b.z - a.z);
    ends[p.z < 0 ? 0 : 1] = section.at(a + (b - a) * (-a.z / (b.z - a.z)));
    stretch = std::max(stretch, tolerance * (std::abs(slope.x) / section.plane.px +
                                             std::abs(slope.y) / section.plane.py));
    ++crossings;
  }

  // 2. What may, but for rounding, lie in the plane.
  if (std::min({std::abs(v[0].z), std::abs(v[1].z), std::abs(v[2].z)}) > tolerance)
    mark(ends.data(), 2, section.margin_px + 2 * stretch, window);
  else
    mark_near(v, section, window);
  if (crossings != 2) return;
  ++work_.segments;
  // In a right-handed frame the front is to the left of the way from one end to the other.
  const int turn = triangle.turn * section.plane.face.sign * (section.along_y ? -1 : 1);
  count_crossing(ends[0], ends[1], turn, window);
}

// The part of a triangle, in the plane's frame, that is within the rounding of the plane.
void SliceCover::mark_near(const std::array<Vec3, 3>& v, const Section& section,
                           const Window& window) {
  std::array<Point, 9> near;
  int count = 0;
  for (int k = 0; k < 3; ++k) {
    const Vec3 &a = v[k].z < v[(k + 1) % 3].z ? v[k] : v[(k + 1) % 3],
               &b = v[k].z < v[(k + 1) % 3].z ? v[(k + 1) % 3] : v[k];
    if (std::abs(v[k].z) <= section.tolerance) near[count++] = section.at(v[k]);
    for (const double cut : {-section.tolerance, section.tolerance})
      if ((a.z < cut) != (b.z < cut))
        near[count++] = section.at(a + (b - a) * std::clamp((cut - a.z) / (b.z - a.z), 0.0, 1.0));
  }
  mark(near.data(), count, section.margin_px, window);
}

// The pixels that the hull of the points touches, or comes near to.
void SliceCover::mark(const Point* points, int count, double margin, const Window& window) {
  if (count == 0) return;
  double lo = kInfinity, hi = -kInfinity, largest = 0;
  for (int k = 0; k < count; ++k) {
    lo = std::min(lo, points[k].across);
    hi = std::max(hi, points[k].across);
    largest = std::max({largest, std::abs(points[k].along), std::abs(points[k].across)});
  }
  margin += 0x1p-40 * largest;
  const double first_line = window.first_across, last_line = window.end_across - 1;
  if (hi + margin < first_line || lo - margin > last_line + 1) return;
  const int j0 = static_cast<int>(std::max(std::floor(lo - margin), first_line));
  const int j1 = static_cast<int>(std::min(std::floor(hi + margin), last_line));
  const int width = window.size();
  for (int j = j0; j <= j1; ++j) {
    const double from = j - margin, to = j + 1 + margin;
    double left = kInfinity, right = -kInfinity;
    for (int a = 0; a < count; ++a)
      for (int b = a; b < count; ++b) {
        const Point &p = points[a], &q = points[b];
        const double rise = q.across - p.across;
        double t0 = 0, t1 = 1;
        if (rise != 0) {
          t0 = (from - p.across) / rise;
          t1 = (to - p.across) / rise;
          if (t0 > t1) std::swap(t0, t1);
        } else if (p.across < from || p.across > to) {
          continue;
        }
        if (t1 < 0 || t0 > 1) continue;
        for (const double t : {std::max(t0, 0.0), std::min(t1, 1.0)}) {
          const double at = p.along + (q.along - p.along) * t;
          left = std::min(left, at);
          right = std::max(right, at);
        }
      }
    left = std::max(left - margin, static_cast<double>(window.first_along));
    right = std::min(right + margin, static_cast<double>(window.end_along - 1) + 0.5);
    if (!(left <= right)) continue;
    std::uint8_t* const line = &touched_[static_cast<std::size_t>(j - window.first_across) * width];
    const int i1 = static_cast<int>(right) - window.first_along;
    for (int i = static_cast<int>(left) - window.first_along; i <= i1; ++i) line[i] = 1;
  }
}

// At the middles of the scan lines that the segment crosses, all before the crossing is inside once
// more or once less.
void SliceCover::count_crossing(const Point& up, const Point& down, int sign,
                                const Window& window) {
  const double lo = std::min(up.across, down.across), hi = std::max(up.across, down.across);
  // Lines whose middle j + 0.5 is in [lo, hi).
  const double first = std::max(std::ceil(lo - 0.5), static_cast<double>(window.first_across));
  const double last = std::min(std::ceil(hi - 0.5) - 1, static_cast<double>(window.end_across - 1));
  if (!(first <= last)) return;
  const int step = up.across > down.across ? sign : -sign;
  const auto [nearest, farthest] = std::minmax(up.along, down.along);
  const double slope = (down.along - up.along) / (down.across - up.across);
  for (int j = static_cast<int>(first); j <= static_cast<int>(last); ++j) {
    const double at = std::clamp(up.along + (j + 0.5 - up.across) * slope, nearest, farthest);
    // The last pixel whose middle lies before the crossing.
    const double before = std::ceil(at - 0.5) - 1;
    if (!(before >= window.first_along)) continue;
    const int i = static_cast<int>(std::min(before, static_cast<double>(window.end_along - 1)));
    steps_[static_cast<std::size_t>(j - window.first_across) * window.size() +
           (i - window.first_along)] += step;
  }
}

void SliceCover::fill(const Used& used, const Section& section, const Window& window,
                      OcclusionMap& map) {
  const int side = section.plane.resolution_px, width = window.size();
  const std::ptrdiff_t along = section.along_y ? side : 1, across = section.along_y ? 1 : side;
  for (int j = window.first_across; j < window.end_across; ++j) {
    std::int32_t* const steps = &steps_[static_cast<std::size_t>(j - window.first_across) * width];
    std::uint8_t* const touched =
        &touched_[static_cast<std::size_t>(j - window.first_across) * width];
    float* at = map.base() + j * across + (window.end_along - 1) * along;
    int more = -used.winding;  // than around the cell
    for (int i = width - 1; i >= 0; --i, at -= along) {
      more += steps[i];
      const bool blocked = more > 0 || (more < 0 && used.solid->two_sided);
      if (blocked && touched[i] == 0 && *at > 0) {
        *at = 0;
        ++work_.pixels;
      }
      steps[i] = 0;
      touched[i] = 0;
    }
  }
}

}  // namespace pvsfarm

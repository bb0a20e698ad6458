#include "tests/support/view_polygon.hpp"

#include <algorithm>
#include <cmath>

namespace pvsfarm {
namespace {

// 1/2 from a pixel's centre to its corner; 1/16 for all snapping and rounding on the way.
constexpr double kShrinkPx = 0.5 + 1.0 / 16;
constexpr double kWindowMarginPx = 2;

double turn(const Vec2& o, const Vec2& a, const Vec2& b) {
  return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
}

// Counter-clockwise convex hull, by gift wrapping.
std::vector<Vec2> wrapped(const std::vector<Vec2>& points) {
  std::size_t start = 0;
  for (std::size_t i = 1; i < points.size(); ++i)
    if (points[i].x < points[start].x ||
        (points[i].x == points[start].x && points[i].y < points[start].y))
      start = i;
  std::vector<Vec2> hull;
  std::size_t at = start;
  do {
    hull.push_back(points[at]);
    std::size_t next = (at + 1) % points.size();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double t = turn(points[at], points[next], points[i]);
      const Vec2 far = points[i] - points[at], reached = points[next] - points[at];
      if (t < 0 ||
          (t == 0 && far.x * far.x + far.y * far.y > reached.x * reached.x + reached.y * reached.y))
        next = i;
    }
    at = next;
  } while (at != start && hull.size() <= points.size());
  return hull;
}

// The part of `polygon` where n . p >= c.
std::vector<Vec2> clipped(const std::vector<Vec2>& polygon, const Vec2& n, double c) {
  std::vector<Vec2> out;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const double a = n.x * p.x + n.y * p.y - c, b = n.x * q.x + n.y * q.y - c;
    if (a >= 0) out.push_back(p);
    if ((a >= 0) != (b >= 0)) out.push_back(p + (q - p) * (a / (a - b)));
  }
  return out;
}

}  // namespace

std::vector<Vec2> shrunk_view(const Piece& piece, const ProjectionPlane& plane, int viewpoint) {
  const Vec3 eye{viewpoint & 1 ? plane.hu : -plane.hu, viewpoint & 2 ? plane.hv : -plane.hv,
                 viewpoint & 4 ? -plane.distance : -plane.distance - 2 * plane.hw};
  std::vector<Vec2> images;
  for (int i = 0; i < piece.point_count; ++i) {
    const Vec3& p = piece.points[i];
    const double t = eye.z / (eye.z - p.z);  // where the line from the eye crosses z = 0
    images.push_back({(eye.x + (p.x - eye.x) * t - plane.x0) / plane.px,
                      (eye.y + (p.y - eye.y) * t - plane.y0) / plane.py});
  }
  const std::vector<Vec2> hull = wrapped(images);
  if (hull.size() < 3) return {};
  const double lo = -kWindowMarginPx, hi = plane.resolution_px + kWindowMarginPx;
  std::vector<Vec2> polygon{{lo, lo}, {hi, lo}, {hi, hi}, {lo, hi}};
  for (std::size_t i = 0; i < hull.size() && !polygon.empty(); ++i) {
    const Vec2 &a = hull[i], &b = hull[(i + 1) % hull.size()];
    const Vec2 n{a.y - b.y, b.x - a.x};
    polygon =
        clipped(polygon, n, n.x * a.x + n.y * a.y + kShrinkPx * (std::abs(n.x) + std::abs(n.y)));
  }
  return polygon.size() < 3 ? std::vector<Vec2>{} : polygon;
}

}  // namespace pvsfarm

#include "tests/adversarial/reference/polygon_erosion.hpp"

namespace pvsfarm::reference {
namespace {

bool on_segment(FlatPoint a, FlatPoint b, FlatPoint p) {
  return turn(a, b, p) == 0 && std::min(a.x, b.x) <= p.x && p.x <= std::max(a.x, b.x) &&
         std::min(a.y, b.y) <= p.y && p.y <= std::max(a.y, b.y);
}

bool in_swept_edges(const Polygon& polygon, const std::vector<FlatPoint>& x, FlatPoint v) {
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    std::vector<FlatPoint> swept;
    for (const FlatPoint step : x) {
      swept.push_back(polygon[k] - step);
      swept.push_back(polygon[(k + 1) % polygon.size()] - step);
    }
    if (in_hull(swept, v)) return true;
  }
  return false;
}

}  // namespace

bool contains(const Polygon& polygon, FlatPoint p) {
  bool inside = false;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const FlatPoint a = polygon[k], b = polygon[(k + 1) % polygon.size()];
    if (on_segment(a, b, p)) return true;
    if ((a.y > p.y) != (b.y > p.y) && (turn(a, b, p) > 0) == (b.y > a.y)) inside = !inside;
  }
  return inside;
}

bool in_hull(const std::vector<FlatPoint>& points, FlatPoint p) {
  // Some triangle of the points holds it.
  for (const FlatPoint a : points)
    for (const FlatPoint b : points)
      for (const FlatPoint c : points) {
        const std::int64_t s = turn(a, b, p), t = turn(b, c, p), u = turn(c, a, p);
        if (s == 0 && t == 0 && u == 0) {
          if (on_segment(a, b, p) || on_segment(b, c, p)) return true;
        } else if ((s >= 0 && t >= 0 && u >= 0) || (s <= 0 && t <= 0 && u <= 0)) {
          return true;
        }
      }
  return false;
}

bool in_erosion_as_printed(const Polygon& polygon, const std::vector<FlatPoint>& x, FlatPoint v) {
  return contains(polygon, v) && !in_swept_edges(polygon, x, v);
}

bool in_erosion(const Polygon& polygon, const std::vector<FlatPoint>& x, FlatPoint v) {
  std::vector<FlatPoint> moved = x;  // holds the origin
  for (FlatPoint& step : moved) step = step - x.front();
  const FlatPoint w = v + x.front();
  return contains(polygon, w) && !in_swept_edges(polygon, moved, w);
}

}  // namespace pvsfarm::reference

#include "common/scene/convex_solid.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

namespace pvsfarm {
namespace {

constexpr std::size_t kMaxSolidTriangles = 4096;  // the test is quadratic
constexpr double kMaxShrink = 1e-3;               // of the way to the middle
constexpr double kRelativeMargin = 1e-12;     // of the coordinates: thousands of double roundings
constexpr double kRounding = 0x1p-49;         // of a distance to a plane, before the sliver factor
constexpr double kStraightCosine = 1 - 1e-8;  // normals this close count as one direction

// A face plane, inside where distance() < 0.
struct FacePlane {
  Vec3 point, normal;
  double margin;  // a distance beyond -margin is certain
  int level = 0;  // -1: exactly in the lowest level, 1: in the highest
  double distance(const Vec3& p) const { return dot(normal, p - point); }
};

struct Shape {
  std::vector<std::uint32_t> vertices;  // that the component uses, ascending
  std::vector<FacePlane> planes;
  Box box;
  Vec3 middle{0.0};
  bool level_base = false, level_top = false;  // some face lies exactly in box.lo.z, box.hi.z
};

Shape measure(const Mesh& mesh, const MeshComponent& component) {
  Shape shape;
  for (const MeshTriangle& t : component.triangles)
    shape.vertices.insert(shape.vertices.end(), t.begin(), t.end());
  std::sort(shape.vertices.begin(), shape.vertices.end());
  shape.vertices.erase(std::unique(shape.vertices.begin(), shape.vertices.end()),
                       shape.vertices.end());
  for (const std::uint32_t v : shape.vertices) shape.box.add(mesh.vertices[v]);
  for (const std::uint32_t v : shape.vertices)
    shape.middle += (mesh.vertices[v] - shape.box.lo) / static_cast<double>(shape.vertices.size());
  shape.middle += shape.box.lo;

  double scale = 0;
  for (int a = 0; a < 3; ++a)
    scale = std::max({scale, std::abs(shape.box.lo[a]), std::abs(shape.box.hi[a])});
  const double diameter = length(shape.box.size());
  for (const MeshTriangle& t : component.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const Vec3 n = cross(b - a, c - a);
    const double size = length(n);
    if (size == 0) continue;  // covers nothing, seen from anywhere
    // A sliver's normal is as uncertain as it is thin.
    const double slenderness = length(b - a) * length(c - a) / size;
    FacePlane plane{a, n / size, kRelativeMargin * scale + kRounding * slenderness * diameter};
    if (a.z == b.z && b.z == c.z && a.z == shape.box.lo.z && n.z < 0) plane.level = -1;
    if (a.z == b.z && b.z == c.z && a.z == shape.box.hi.z && n.z > 0) plane.level = 1;
    shape.level_base = shape.level_base || plane.level < 0;
    shape.level_top = shape.level_top || plane.level > 0;
    shape.planes.push_back(plane);
  }
  return shape;
}

// Every face exactly in a side of the box, looking out: then the matter is the box.
bool is_exact_box(const Mesh& mesh, const MeshComponent& component, const Shape& shape) {
  for (const MeshTriangle& t : component.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const Vec3 n = cross(b - a, c - a);
    if (n == Vec3(0.0)) continue;
    bool on_side = false;
    for (int k = 0; k < 3; ++k) {
      if (a[k] != b[k] || b[k] != c[k]) continue;
      on_side =
          on_side || (a[k] == shape.box.lo[k] && n[k] < 0) || (a[k] == shape.box.hi[k] && n[k] > 0);
    }
    if (!on_side) return false;
  }
  return shape.box.lo.x < shape.box.hi.x && shape.box.lo.y < shape.box.hi.y &&
         shape.box.lo.z < shape.box.hi.z;
}

// Vertices that span the hull: those whose faces look in three independent directions.
std::vector<std::uint32_t> corner_vertices(const Mesh& mesh, const MeshComponent& component,
                                           const Shape& shape) {
  std::vector<std::vector<Vec3>> directions(mesh.vertices.size());
  for (const MeshTriangle& t : component.triangles) {
    const Vec3 n =
        cross(mesh.vertices[t[1]] - mesh.vertices[t[0]], mesh.vertices[t[2]] - mesh.vertices[t[0]]);
    if (n == Vec3(0.0)) continue;
    const Vec3 unit = n / length(n);
    for (const std::uint32_t v : t) {
      const bool known = std::any_of(directions[v].begin(), directions[v].end(),
                                     [&](const Vec3& d) { return dot(d, unit) > kStraightCosine; });
      if (!known) directions[v].push_back(unit);
    }
  }
  std::vector<std::uint32_t> corners;
  for (const std::uint32_t v : shape.vertices)
    if (directions[v].size() >= 3) corners.push_back(v);
  return corners;
}

// At most 26 of `corners`: those farthest in each direction of a 3 by 3 by 3 grid. Ties by x and y,
// so that the top and the base of a prism keep the same columns.
std::vector<std::uint32_t> farthest_corners(const Mesh& mesh,
                                            const std::vector<std::uint32_t>& corners) {
  std::set<std::uint32_t> chosen;
  for (int k = 0; k < 27; ++k) {
    const Vec3 direction(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
    if (direction == Vec3(0.0)) continue;
    const auto rank = [&](std::uint32_t v) {
      const Vec3& p = mesh.vertices[v];
      return std::tuple(dot(direction, p), p.x, p.y);
    };
    chosen.insert(*std::max_element(corners.begin(), corners.end(),
                                    [&](auto a, auto b) { return rank(a) < rank(b); }));
  }
  return {chosen.begin(), chosen.end()};
}

// A vertex on its way to the middle. One that lies in a level base or top stays at its height,
// and the faces of that level do not bind it: it is a limit of points below them.
struct Mover {
  Vec3 from, step;
  int level = 0;
  bool bound_by(const FacePlane& plane) const { return level == 0 || plane.level != level; }
  Vec3 at(double way) const { return from + step * way; }
};

Mover mover_of(const Vec3& p, const Shape& shape) {
  Mover mover{p, shape.middle - p};
  if (shape.level_base && p.z == shape.box.lo.z) mover.level = -1;
  if (shape.level_top && p.z == shape.box.hi.z) mover.level = 1;
  if (mover.level != 0) mover.step.z = 0;
  return mover;
}

// The smallest way that brings all movers inside all planes, or nothing.
std::optional<double> smallest_way(const std::vector<Mover>& movers, const Shape& shape) {
  double way = 0;
  for (const Mover& m : movers)
    for (const FacePlane& plane : shape.planes) {
      if (!m.bound_by(plane)) continue;
      const double outside = plane.distance(m.from) + 2 * plane.margin;
      if (outside <= 0) continue;
      const double speed = -dot(plane.normal, m.step);
      if (!(outside <= speed * kMaxShrink)) return std::nullopt;
      way = std::max(way, outside / speed);
    }
  return way;
}

bool inside(const Vec3& p, const Mover& mover, const Shape& shape) {
  return std::all_of(shape.planes.begin(), shape.planes.end(), [&](const FacePlane& plane) {
    return !mover.bound_by(plane) || plane.distance(p) <= -plane.margin;
  });
}

// Hull of points in the plane, counter-clockwise, without points on its edges.
std::vector<Vec2> hull_of(std::vector<Vec2> points) {
  std::sort(points.begin(), points.end(),
            [](const Vec2& a, const Vec2& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  std::vector<Vec2> hull;
  const auto chain = [&hull](auto first, auto last) {
    const std::size_t start = hull.size();
    for (auto p = first; p != last; ++p) {
      while (hull.size() >= start + 2) {
        const Vec2 u = hull.back() - hull[hull.size() - 2], v = *p - hull.back();
        if (u.x * v.y - u.y * v.x > 0) break;
        hull.pop_back();
      }
      hull.push_back(*p);
    }
    hull.pop_back();
  };
  chain(points.begin(), points.end());
  chain(points.rbegin(), points.rend());
  return hull;
}

// Moves what hangs over the base by no more than rounding back above it; false if more does.
bool pull_over_base(std::vector<Vec3>& points, std::size_t base_points, const Shape& shape) {
  std::vector<Vec2> base;
  for (std::size_t i = 0; i < base_points; ++i) base.emplace_back(points[i].x, points[i].y);
  const std::vector<Vec2> hull = hull_of(base);
  if (hull.size() < 3) return false;
  const Vec2 middle(shape.middle.x, shape.middle.y);
  const double margin = shape.planes.front().margin;
  for (std::size_t i = base_points; i < points.size(); ++i) {
    const Vec2 p(points[i].x, points[i].y);
    if (std::find(base.begin(), base.end(), p) != base.end()) continue;
    double way = 0;
    for (std::size_t k = 0; k < hull.size(); ++k) {
      const Vec2 edge = hull[(k + 1) % hull.size()] - hull[k];
      const Vec2 inward = Vec2(-edge.y, edge.x) / length(edge);
      const double in = dot(inward, p - hull[k]), middle_in = dot(inward, middle - hull[k]);
      if (in >= margin) continue;
      if (!(margin - in <= (middle_in - in) * kMaxShrink)) return false;
      way = std::max(way, (margin - in) / (middle_in - in) * (1 + 1e-9));
    }
    // Towards the middle, which is inside all planes: the point stays inside them.
    points[i] += (shape.middle - points[i]) * way;
  }
  return true;
}

bool is_upright(const std::vector<Vec3>& points, std::size_t base_points) {
  if (points.size() != 2 * base_points) return false;
  const auto same_column = [](const Vec3& a, const Vec3& b) { return a.x == b.x && a.y == b.y; };
  for (std::size_t i = base_points; i < points.size(); ++i) {
    if (points[i].z != points[base_points].z) return false;
    if (std::none_of(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(base_points),
                     [&](const Vec3& b) { return same_column(b, points[i]); }))
      return false;
  }
  return true;
}

ConvexSolid exact_box(const Box& box, double ground) {
  ConvexSolid solid;
  for (int k = 0; k < 8; ++k) solid.points.push_back(box.corner(k));
  solid.base_points = box.lo.z <= ground ? 4 : 0;
  solid.is_box = solid.is_prism = true;
  return solid;
}

}  // namespace

std::optional<ConvexSolid> convex_solid(const Mesh& mesh, const MeshComponent& component,
                                        double ground) {
  if (!component.closed_outward || component.triangles.size() > kMaxSolidTriangles)
    return std::nullopt;
  const Shape shape = measure(mesh, component);
  if (shape.planes.empty()) return std::nullopt;
  if (is_exact_box(mesh, component, shape)) return exact_box(shape.box, ground);

  // 1. All vertices must reach the inside within the allowed way, or it is not convex.
  std::vector<Mover> movers;
  for (const std::uint32_t v : shape.vertices) movers.push_back(mover_of(mesh.vertices[v], shape));
  const std::optional<double> way = smallest_way(movers, shape);
  if (!way) return std::nullopt;

  // 2. The points: base first, moved, and checked as they were rounded.
  std::vector<std::uint32_t> corners = corner_vertices(mesh, component, shape);
  if (corners.size() < 4) return std::nullopt;
  const auto is_lowest = [&](std::uint32_t v) { return mesh.vertices[v].z == shape.box.lo.z; };
  const auto lowest = std::count_if(corners.begin(), corners.end(), is_lowest);
  if (corners.size() + static_cast<std::size_t>(lowest) > kMaxSolidPoints)
    corners = farthest_corners(mesh, corners);
  std::stable_partition(corners.begin(), corners.end(), is_lowest);
  ConvexSolid solid;
  for (const std::uint32_t v : corners) {
    const Mover mover = mover_of(mesh.vertices[v], shape);
    solid.points.push_back(mover.at(*way));
    if (mover.level < 0) ++solid.base_points;
    if (!inside(solid.points.back(), mover, shape)) return std::nullopt;
  }
  solid.shrink = *way * length(shape.box.size()) + shape.planes.front().margin;

  // 3. Flags.
  std::vector<Vec3> over_base = solid.points;
  if (solid.base_points >= 3 && pull_over_base(over_base, solid.base_points, shape)) {
    solid.points = std::move(over_base);
    solid.is_prism = is_upright(solid.points, solid.base_points);
    const bool fits = solid.points.size() + solid.base_points <= kMaxSolidPoints;
    if (shape.box.lo.z > ground || !fits) solid.base_points = 0;
  } else {
    solid.base_points = 0;
  }
  return solid;
}

bool is_star_shaped(const Mesh& mesh, const MeshComponent& component) {
  const Shape shape = measure(mesh, component);
  return std::all_of(shape.planes.begin(), shape.planes.end(), [&](const FacePlane& plane) {
    return plane.distance(shape.middle) <= -plane.margin;
  });
}

}  // namespace pvsfarm

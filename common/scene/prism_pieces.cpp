#include "common/scene/prism_pieces.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/scene/coplanar_faces.hpp"

namespace pvsfarm {
namespace {

constexpr std::size_t kMaxRing = kMaxSolidPoints / 3;  // base, top, and the base lowered
constexpr double kMaxShrink = 1e-3;
constexpr double kRelativeMargin = 1e-12;

double cross_of(const Vec2& u, const Vec2& v) { return u.x * v.y - u.y * v.x; }
Vec2 flat(const Vec3& p) { return {p.x, p.y}; }

struct Levels {
  double low, high;
};

// The base triangles of an upright prism, or nothing.
std::optional<std::vector<MeshTriangle>> base_of(const Mesh& mesh, const MeshComponent& component,
                                                 const Levels& levels) {
  std::vector<MeshTriangle> base;
  for (const MeshTriangle& t : component.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    int low = 0;
    for (const Vec3* p : {&a, &b, &c}) {
      if (p->z != levels.low && p->z != levels.high) return std::nullopt;
      low += p->z == levels.low;
    }
    const double turn = cross_of(flat(b) - flat(a), flat(c) - flat(a));
    if (low == 3) {
      if (turn > 0) return std::nullopt;  // a base that faces up
      if (turn < 0) base.push_back(t);
    } else if (low > 0) {
      const bool vertical = flat(a) == flat(b) || flat(b) == flat(c) || flat(c) == flat(a);
      if (!vertical) return std::nullopt;
    }
  }
  return base;
}

// Counter-clockwise seen from above.
std::vector<Vec2> ring_of(const FlatPolygon& polygon) {
  std::vector<Vec2> ring;
  for (const Vec3& p : polygon.points) ring.push_back(flat(p));
  std::reverse(ring.begin(), ring.end());  // the base faces down
  return ring;
}

double smallest_inside(const std::vector<Vec2>& ring, const Vec2& p) {
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const Vec2 edge = ring[(k + 1) % ring.size()] - ring[k];
    smallest = std::min(smallest, cross_of(edge, p - ring[k]) / length(edge));
  }
  return smallest;
}

// Points of `ring`, moved to its middle until all are strictly inside all its edges.
std::optional<std::vector<Vec2>> moved_inside(const std::vector<Vec2>& ring, double margin) {
  Vec2 middle(0.0);
  for (const Vec2& p : ring) middle += (p - ring[0]) / static_cast<double>(ring.size());
  middle += ring[0];
  const double depth = smallest_inside(ring, middle);
  double way = 0;
  for (const Vec2& p : ring) {
    const double outside = 2 * margin - smallest_inside(ring, p);
    if (outside > 0) way = std::max(way, outside / (depth + outside - 2 * margin));
  }
  if (!(depth > 4 * margin) || !(way <= kMaxShrink)) return std::nullopt;
  std::vector<Vec2> inside;
  for (const Vec2& p : ring) {
    inside.push_back(p + (middle - p) * way);
    if (smallest_inside(ring, inside.back()) < margin) return std::nullopt;
  }
  return inside;
}

// Leaves out the corners that cut off least, until there are few enough.
void simplify(std::vector<Vec2>& ring) {
  while (ring.size() > kMaxRing) {
    std::size_t least = 0;
    double least_area = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const Vec2 &before = ring[(k + ring.size() - 1) % ring.size()],
                 &after = ring[(k + 1) % ring.size()];
      const double area = cross_of(ring[k] - before, after - before);
      if (area >= least_area) continue;
      least_area = area;
      least = k;
    }
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(least));
  }
}

ConvexSolid upright(const std::vector<Vec2>& ring, const Levels& levels, double ground) {
  ConvexSolid solid;
  for (const Vec2& p : ring) solid.points.emplace_back(p.x, p.y, levels.low);
  for (const Vec2& p : ring) solid.points.emplace_back(p.x, p.y, levels.high);
  solid.base_points = levels.low <= ground ? ring.size() : 0;
  solid.is_prism = true;
  return solid;
}

}  // namespace

std::vector<ConvexSolid> prism_pieces(const Mesh& mesh, const MeshComponent& component,
                                      double ground) {
  if (!component.closed_outward) return {};
  Box box;
  double scale = 0;
  for (const MeshTriangle& t : component.triangles)
    for (const std::uint32_t v : t) {
      box.add(mesh.vertices[v]);
      scale = std::max({scale, std::abs(mesh.vertices[v].x), std::abs(mesh.vertices[v].y)});
    }
  const Levels levels{box.lo.z, box.hi.z};
  const auto base = base_of(mesh, component, levels);
  if (!base || !(levels.low < levels.high)) return {};

  std::vector<ConvexSolid> pieces;
  for (const FlatPolygon& polygon : merge_coplanar(mesh, *base)) {
    std::optional<std::vector<Vec2>> ring = moved_inside(ring_of(polygon), kRelativeMargin * scale);
    if (!ring) continue;
    simplify(*ring);
    pieces.push_back(upright(*ring, levels, ground));
  }
  return pieces;
}

}  // namespace pvsfarm

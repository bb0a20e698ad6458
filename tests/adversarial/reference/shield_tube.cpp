#include "tests/adversarial/reference/shield_tube.hpp"

#include <algorithm>
#include <set>

namespace pvsfarm::reference {
namespace {

std::pair<int, int> undirected(int a, int b) { return {std::min(a, b), std::max(a, b)}; }

bool between(const IntPoint& p, const IntPoint& q, const IntPoint& r) {
  std::int64_t dot = 0;
  for (int k = 0; k < 3; ++k) dot += (r[k] - p[k]) * (r[k] - q[k]);
  return dot <= 0;
}

// A facet: all points of its plane, and three of them that look counter-clockwise from outside.
struct Facet {
  std::array<int, 3> plane;
  std::vector<int> points;
};

// The facet through i, j, k, if all points lie on one side.
std::optional<Facet> facet_through(std::span<const IntPoint> points, int i, int j, int k) {
  Facet facet{{i, j, k}, {}};
  int inside = 0;
  for (int m = 0; m < static_cast<int>(points.size()); ++m) {
    const int side = orientation(points[i], points[j], points[k], points[m]);
    if (side == 0) facet.points.push_back(m);
    if (side * inside < 0) return std::nullopt;
    if (side != 0) inside = side;
  }
  if (inside == 0) return std::nullopt;
  if (inside > 0) std::swap(facet.plane[1], facet.plane[2]);
  return facet;
}

// The facet's border, counter-clockwise from outside, without points inside it or on its edges.
std::vector<int> border(std::span<const IntPoint> points, const Facet& facet) {
  IntPoint apex;  // any point off the plane, inside
  for (const IntPoint& p : points)
    if (orientation(points[facet.plane[0]], points[facet.plane[1]], points[facet.plane[2]], p) < 0)
      apex = p;
  std::vector<int> once;  // flat cells have corners twice
  for (const int p : facet.points)
    if (std::none_of(once.begin(), once.end(), [&](int q) { return points[p] == points[q]; }))
      once.push_back(p);
  std::map<int, int> next;
  for (const int p : once)
    for (const int q : once) {
      if (p == q) continue;
      const bool edge = std::all_of(facet.points.begin(), facet.points.end(), [&](int r) {
        const int side = orientation(apex, points[p], points[q], points[r]);
        return side > 0 || (side == 0 && between(points[p], points[q], points[r]));
      });
      if (edge && !next.contains(p)) next[p] = q;
    }
  std::vector<int> loop;
  for (int p = next.begin()->first; loop.size() < next.size(); p = next.at(p)) loop.push_back(p);
  return loop;
}

// All facets of the hull of `points`, each once.
std::vector<Facet> facets_of(std::span<const IntPoint> points) {
  std::vector<Facet> facets;
  std::set<std::vector<int>> known;
  const int n = static_cast<int>(points.size());
  for (int i = 0; i < n; ++i)
    for (int j = i + 1; j < n; ++j)
      for (int k = j + 1; k < n; ++k)
        if (const auto facet = facet_through(points, i, j, k))
          if (known.insert(facet->points).second) facets.push_back(*facet);
  return facets;
}

}  // namespace

Stab stab(const IntPoint& a, const IntPoint& b, const TriangleMesh& mesh, int triangle) {
  return stab(a, b, mesh.corner(triangle, 0), mesh.corner(triangle, 1), mesh.corner(triangle, 2));
}

EdgeMap::EdgeMap(const TriangleMesh& mesh) {
  for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t)
    for (int k = 0; k < 3; ++k)
      triangles_[undirected(mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3])].push_back(t);
}

const std::vector<int>& EdgeMap::around(int a, int b) const {
  return triangles_.at(undirected(a, b));
}

int EdgeMap::across(int triangle, int a, int b) const {
  for (const int t : around(a, b))
    if (t != triangle) return t;
  return -1;
}

std::optional<Hull> hull_of(const Corners& a, const Corners& b) {
  std::vector<IntPoint> points(a.begin(), a.end());
  points.insert(points.end(), b.begin(), b.end());
  Hull hull;
  hull.surface.vertices = points;
  for (const Facet& facet : facets_of(points)) {
    const std::vector<int> loop = border(points, facet);
    const bool of_a = std::any_of(loop.begin(), loop.end(), [](int p) { return p < 8; });
    const bool of_b = std::any_of(loop.begin(), loop.end(), [](int p) { return p >= 8; });
    for (std::size_t k = 2; k < loop.size(); ++k) {
      hull.surface.triangles.push_back({loop[0], loop[k - 1], loop[k]});
      hull.is_tube.push_back(of_a && of_b);
    }
  }
  if (hull.surface.triangles.empty()) return std::nullopt;
  return hull;
}

bool misses_hull(const Hull& hull, const IntPoint& p, const IntPoint& q) {
  for (int t = 0; t < static_cast<int>(hull.surface.triangles.size()); ++t)
    if (hull.surface.side(t, p) > 0 && hull.surface.side(t, q) > 0) return true;
  return false;
}

bool contains_all(const Corners& moved, const Corners& corners) {
  const std::vector<Facet> facets = facets_of(moved);
  for (const Facet& facet : facets)
    for (const IntPoint& p : corners)
      if (orientation(moved[facet.plane[0]], moved[facet.plane[1]], moved[facet.plane[2]], p) > 0)
        return false;
  return !facets.empty();
}

}  // namespace pvsfarm::reference

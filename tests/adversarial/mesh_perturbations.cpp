// The perturbations that make other triangles of the same surface.
#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "tests/adversarial/perturbations.hpp"

namespace pvsfarm {
namespace {

using Indices = std::array<std::uint32_t, 3>;

bool is_less(const Vec3& a, const Vec3& b) {
  return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

// Points on the edges of one object. They depend on the positions of an edge's ends alone, so that
// neighbours get the same point bit for bit, even if they do not share vertices.
class EdgePoints {
 public:
  explicit EdgePoints(SourceObject& object) : object_(object) {}

  // The point k / steps of the way from a to b.
  std::uint32_t at(std::uint32_t a, std::uint32_t b, int k, int steps) {
    if (is_less(object_.vertices[b], object_.vertices[a])) {
      std::swap(a, b);
      k = steps - k;
    }
    const auto [found, is_new] =
        points_.try_emplace({a, b, k}, static_cast<std::uint32_t>(object_.vertices.size()));
    if (is_new) {
      const Vec3 p = object_.vertices[a], q = object_.vertices[b];
      object_.vertices.push_back(p + (q - p) * (static_cast<double>(k) / steps));
    }
    return found->second;
  }

 private:
  SourceObject& object_;
  std::map<std::tuple<std::uint32_t, std::uint32_t, int>, std::uint32_t> points_;
};

std::uint32_t add_vertex(SourceObject& object, const Vec3& p) {
  object.vertices.push_back(p);
  return static_cast<std::uint32_t>(object.vertices.size() - 1);
}

// Replaces the triangles of every object: fn(object, triangle, edge points, new triangles).
template <class Fn>
World with_each_triangle(World world, Fn&& fn) {
  for (SourceObject& object : world.source.objects) {
    const std::vector<Indices> old = std::exchange(object.triangles, {});
    std::vector<Indices> triangles;
    EdgePoints edges(object);
    for (const Indices& t : old) fn(object, t, edges, triangles);
    object.triangles = std::move(triangles);
  }
  return world;
}

}  // namespace

World quartered(World world) {
  return with_each_triangle(
      std::move(world), [](SourceObject&, const Indices& t, EdgePoints& edges, auto& out) {
        const std::uint32_t ab = edges.at(t[0], t[1], 1, 2), bc = edges.at(t[1], t[2], 1, 2),
                            ca = edges.at(t[2], t[0], 1, 2);
        out.insert(out.end(), {{t[0], ab, ca}, {ab, t[1], bc}, {ca, bc, t[2]}, {ab, bc, ca}});
      });
}

World fanned(World world, int steps) {
  return with_each_triangle(
      std::move(world), [steps](SourceObject& o, const Indices& t, EdgePoints& edges, auto& out) {
        std::vector<std::uint32_t> rim;
        for (int side = 0; side < 3; ++side) {
          const std::uint32_t a = t[side], b = t[(side + 1) % 3];
          rim.push_back(a);
          for (int k = 1; k < steps; ++k) rim.push_back(edges.at(a, b, k, steps));
        }
        const Vec3 a = o.vertices[t[0]], b = o.vertices[t[1]], c = o.vertices[t[2]];
        const std::uint32_t middle = add_vertex(o, a * 0.25 + b * 0.25 + c * 0.5);
        for (std::size_t k = 0; k < rim.size(); ++k)
          out.push_back({rim[k], rim[(k + 1) % rim.size()], middle});
      });
}

World with_t_junctions(World world) {
  std::set<std::tuple<const SourceObject*, std::uint32_t, std::uint32_t>> split;
  return with_each_triangle(
      std::move(world), [&](SourceObject& o, const Indices& t, EdgePoints& edges, auto& out) {
        for (int side = 0; side < 3; ++side) {
          const std::uint32_t a = t[side], b = t[(side + 1) % 3], c = t[(side + 2) % 3];
          if (!split.insert({&o, std::min(a, b), std::max(a, b)}).second)
            continue;  // its neighbour has the junction
          const std::uint32_t middle = edges.at(a, b, 1, 2);
          out.push_back({a, middle, c});
          out.push_back({middle, b, c});
          return;
        }
        out.push_back(t);
      });
}

World with_slivers(World world, double share) {
  return with_each_triangle(
      std::move(world), [share](SourceObject& o, const Indices& t, EdgePoints&, auto& out) {
        const Vec3 a = o.vertices[t[0]], b = o.vertices[t[1]], c = o.vertices[t[2]];
        const Vec3 foot = (a + b) * 0.5;
        const std::uint32_t p = add_vertex(o, foot + (c - foot) * share);
        out.insert(out.end(), {{t[0], t[1], p}, {t[1], t[2], p}, {t[2], t[0], p}});
      });
}

World with_duplicate_faces(World world) {
  return with_each_triangle(std::move(world),
                            [](SourceObject&, const Indices& t, EdgePoints&, auto& out) {
                              out.push_back(t);
                              out.push_back({t[1], t[2], t[0]});
                            });
}

}  // namespace pvsfarm

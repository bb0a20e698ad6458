#include "common/scene/mesh_components.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace pvsfarm {
namespace {

constexpr std::uint32_t kNone = UINT32_MAX;

struct EdgeUse {
  std::uint32_t low, high;  // vertices, low < high
  std::uint32_t triangle;
  bool forward;  // the triangle runs from low to high
};

bool same_edge(const EdgeUse& a, const EdgeUse& b) { return a.low == b.low && a.high == b.high; }

std::vector<EdgeUse> sorted_edges(const std::vector<MeshTriangle>& triangles) {
  std::vector<EdgeUse> edges;
  edges.reserve(triangles.size() * 3);
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles[t][k], b = triangles[t][(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), t, a < b});
    }
  std::sort(edges.begin(), edges.end(), [](const EdgeUse& a, const EdgeUse& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  return edges;
}

// fn(first, last) for each group of uses of one edge.
template <class Fn>
void for_each_edge(const std::vector<EdgeUse>& edges, Fn&& fn) {
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i + 1;
    while (end < edges.size() && same_edge(edges[i], edges[end])) ++end;
    fn(i, end);
    i = end;
  }
}

// Without triangles that use a vertex twice, and without the second of two triangles that are the
// same matter: equal but for rotation, or, where winding means nothing, for winding.
std::vector<MeshTriangle> distinct_triangles(const Mesh& mesh, bool two_sided) {
  struct Key {
    MeshTriangle vertices;
    std::uint32_t triangle;
  };
  std::vector<Key> keys;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    MeshTriangle v = mesh.triangles[t];
    if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
    std::rotate(v.begin(), std::min_element(v.begin(), v.end()), v.end());
    if (two_sided && v[1] > v[2]) std::swap(v[1], v[2]);
    keys.push_back({v, t});
  }
  std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
    return std::tie(a.vertices, a.triangle) < std::tie(b.vertices, b.triangle);
  });
  const auto last = std::unique(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
    return a.vertices == b.vertices;
  });
  keys.erase(last, keys.end());
  std::sort(keys.begin(), keys.end(),
            [](const Key& a, const Key& b) { return a.triangle < b.triangle; });
  std::vector<MeshTriangle> triangles;
  for (const Key& key : keys) triangles.push_back(mesh.triangles[key.triangle]);
  return triangles;
}

// The component of each triangle, numbered by first triangle.
std::vector<std::uint32_t> component_numbers(const std::vector<MeshTriangle>& triangles,
                                             const std::vector<EdgeUse>& edges) {
  std::vector<std::uint32_t> parent(triangles.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root_of = [&parent](std::uint32_t t) {
    while (parent[t] != t) t = parent[t] = parent[parent[t]];
    return t;
  };
  for_each_edge(edges, [&](std::size_t i, std::size_t end) {
    if (end - i != 2) return;
    const std::uint32_t a = root_of(edges[i].triangle), b = root_of(edges[i + 1].triangle);
    parent[std::max(a, b)] = std::min(a, b);
  });
  std::vector<std::uint32_t> number(triangles.size(), kNone);
  std::uint32_t count = 0;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const std::uint32_t root = root_of(t);
    number[t] = root == t ? count++ : number[root];
  }
  return number;
}

struct Neighbour {
  std::uint32_t triangle;
  bool agrees;  // the two run along their edge in opposite directions
};

// Turns triangles so that neighbours agree, as far as that can be.
void orient(std::vector<MeshTriangle>& triangles,
            const std::vector<std::array<Neighbour, 3>>& neighbours) {
  std::vector<std::int8_t> turn(triangles.size(), -1);
  std::vector<std::uint32_t> queue;
  for (std::uint32_t seed = 0; seed < triangles.size(); ++seed) {
    if (turn[seed] >= 0) continue;
    turn[seed] = 0;
    queue.assign(1, seed);
    while (!queue.empty()) {
      const std::uint32_t t = queue.back();
      queue.pop_back();
      for (const Neighbour& n : neighbours[t]) {
        if (n.triangle == kNone || turn[n.triangle] >= 0) continue;
        turn[n.triangle] = n.agrees ? turn[t] : static_cast<std::int8_t>(1 - turn[t]);
        queue.push_back(n.triangle);
      }
    }
  }
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    if (turn[t] == 1) std::swap(triangles[t][1], triangles[t][2]);
}

std::vector<std::array<Neighbour, 3>> neighbours_of(const std::vector<MeshTriangle>& triangles) {
  std::vector<std::array<Neighbour, 3>> neighbours(triangles.size());
  for (auto& n : neighbours) n.fill({kNone, true});
  const auto add = [&neighbours](std::uint32_t t, const Neighbour& n) {
    for (Neighbour& slot : neighbours[t])
      if (slot.triangle == kNone) {
        slot = n;
        return;
      }
  };
  const std::vector<EdgeUse> edges = sorted_edges(triangles);
  for_each_edge(edges, [&](std::size_t i, std::size_t end) {
    if (end - i != 2) return;
    const bool agrees = edges[i].forward != edges[i + 1].forward;
    add(edges[i].triangle, {edges[i + 1].triangle, agrees});
    add(edges[i + 1].triangle, {edges[i].triangle, agrees});
  });
  return neighbours;
}

bool is_closed(const std::vector<MeshTriangle>& triangles) {
  const std::vector<EdgeUse> edges = sorted_edges(triangles);
  bool closed = true;
  for_each_edge(edges, [&](std::size_t i, std::size_t end) {
    closed = closed && end - i == 2 && edges[i].forward != edges[i + 1].forward;
  });
  return closed;
}

double volume_times_six(const Mesh& mesh, const std::vector<MeshTriangle>& triangles) {
  const Vec3 origin = mesh.vertices[triangles[0][0]];
  double volume = 0;
  for (const MeshTriangle& t : triangles)
    volume += dot(mesh.vertices[t[0]] - origin,
                  cross(mesh.vertices[t[1]] - origin, mesh.vertices[t[2]] - origin));
  return volume;
}

}  // namespace

std::vector<MeshComponent> split_components(const Mesh& mesh, bool two_sided) {
  std::vector<MeshTriangle> triangles = distinct_triangles(mesh, two_sided);
  if (two_sided) orient(triangles, neighbours_of(triangles));

  std::vector<MeshComponent> components;
  const auto numbers = component_numbers(triangles, sorted_edges(triangles));
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (numbers[t] == components.size()) components.emplace_back();
    components[numbers[t]].triangles.push_back(triangles[t]);
  }
  for (MeshComponent& component : components) {
    if (!is_closed(component.triangles)) continue;
    const double volume = volume_times_six(mesh, component.triangles);
    component.closed_outward = volume > 0 || (two_sided && volume < 0);
    if (volume < 0 && two_sided)
      for (MeshTriangle& t : component.triangles) std::swap(t[1], t[2]);
  }
  return components;
}

}  // namespace pvsfarm

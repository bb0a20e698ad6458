#include "coordinator/generate/mesh_kit.hpp"

#include <array>
#include <map>
#include <utility>

#include "coordinator/generate/generated_scene.hpp"

namespace pvsfarm {
namespace {

using Quad = std::array<std::uint32_t, 4>;  // counter-clockwise seen from the front

void add_quad(SourceObject& object, const Quad& q) {
  object.triangles.push_back({q[0], q[1], q[2]});
  object.triangles.push_back({q[0], q[2], q[3]});
}

// Corners as Box::corner numbers them: bit 0 picks x, bit 1 y, bit 2 z.
constexpr std::array<Quad, 6> kBoxFaces{Quad{0, 4, 6, 2}, Quad{1, 3, 7, 5}, Quad{0, 1, 5, 4},
                                        Quad{2, 6, 7, 3}, Quad{0, 2, 3, 1}, Quad{4, 5, 7, 6}};

void add_hexahedron(SourceObject& object, const std::array<Vec3, 8>& corners) {
  const auto first = static_cast<std::uint32_t>(object.vertices.size());
  object.vertices.insert(object.vertices.end(), corners.begin(), corners.end());
  for (const Quad& face : kBoxFaces)
    add_quad(object, {first + face[0], first + face[1], first + face[2], first + face[3]});
}

}  // namespace

void add_box(SourceObject& object, const Box& box) {
  std::array<Vec3, 8> corners;
  for (int k = 0; k < 8; ++k) corners[k] = box.corner(k);
  add_hexahedron(object, corners);
}

SourceObject box_object(std::string name, const Box& box) {
  SourceObject object{.name = std::move(name)};
  add_box(object, box);
  return object;
}

void add_frustum(SourceObject& object, const Box& base, const Box& top) {
  std::array<Vec3, 8> corners;
  for (int k = 0; k < 8; ++k) corners[k] = k < 4 ? base.corner(k) : top.corner(k);
  add_hexahedron(object, corners);
}

void add_frustum(SourceObject& object, const Box& base, const Box& top,
                 const std::array<int, 3>& cuts) {
  std::array<std::vector<double>, 3> steps;
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i <= cuts[a]; ++i) steps[a].push_back(static_cast<double>(i) / cuts[a]);
  const std::size_t first = object.vertices.size();
  add_lattice(object, {steps[0], steps[1], steps[2], [](int, int, int) { return true; }});
  // From the unit cube to the frustum.
  for (std::size_t v = first; v < object.vertices.size(); ++v) {
    const Vec3 unit = object.vertices[v];
    Vec3 at;
    for (int a = 0; a < 2; ++a) {
      const double lo = base.lo[a] + unit.z * (top.lo[a] - base.lo[a]);
      const double hi = base.hi[a] + unit.z * (top.hi[a] - base.hi[a]);
      at[a] = snap(lo + unit[a] * (hi - lo));
    }
    at.z = snap(base.lo.z + unit.z * (base.hi.z - base.lo.z));
    object.vertices[v] = at;
  }
}

void add_prism(SourceObject& object, const Extrusion& e) {
  const auto first = static_cast<std::uint32_t>(object.vertices.size());
  const auto n = static_cast<std::uint32_t>(e.profile.size());
  for (const double at : {e.hi, e.lo})
    for (const Vec2& p : e.profile)
      // Along y the profile is turned by a quarter, (x, y) -> (-y, x), which keeps orientation.
      object.vertices.push_back(e.along_y ? Vec3{-p.x, at, p.y} : Vec3{at, p.x, p.y});
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    add_quad(object, {first + i, first + n + i, first + n + j, first + j});
  }
  for (std::uint32_t i = 1; i + 1 < n; ++i) {
    object.triangles.push_back({first, first + i, first + i + 1});
    object.triangles.push_back({first + n, first + n + i + 1, first + n + i});
  }
}

void add_ground(SourceObject& object, const Box& box, double step) {
  const std::vector<double> xs = even_steps(box.lo.x, box.hi.x, step);
  const std::vector<double> ys = even_steps(box.lo.y, box.hi.y, step);
  const auto first = static_cast<std::uint32_t>(object.vertices.size());
  const auto width = static_cast<std::uint32_t>(xs.size());
  for (const double y : ys)
    for (const double x : xs) object.vertices.push_back({x, y, box.lo.z});
  for (std::uint32_t y = 0; y + 1 < ys.size(); ++y)
    for (std::uint32_t x = 0; x + 1 < width; ++x) {
      const std::uint32_t at = first + y * width + x;
      add_quad(object, {at, at + 1, at + width + 1, at + width});
    }
}

void add_lattice(SourceObject& object, const Lattice& lattice) {
  const std::array<int, 3> size{static_cast<int>(lattice.xs.size()) - 1,
                                static_cast<int>(lattice.ys.size()) - 1,
                                static_cast<int>(lattice.zs.size()) - 1};
  const auto solid = [&](const std::array<int, 3>& c) {
    for (int a = 0; a < 3; ++a)
      if (c[a] < 0 || c[a] >= size[a]) return false;
    return lattice.solid(c[0], c[1], c[2]);
  };
  std::map<std::array<int, 3>, std::uint32_t> vertices;
  const auto vertex = [&](std::array<int, 3> at) {
    const auto next = static_cast<std::uint32_t>(object.vertices.size());
    const auto [entry, is_new] = vertices.try_emplace(at, next);
    if (is_new)
      object.vertices.push_back({lattice.xs[at[0]], lattice.ys[at[1]], lattice.zs[at[2]]});
    return entry->second;
  };
  for (int z = 0; z < size[2]; ++z)
    for (int y = 0; y < size[1]; ++y)
      for (int x = 0; x < size[0]; ++x) {
        if (!solid({x, y, z})) continue;
        for (int face = 0; face < 6; ++face) {
          std::array<int, 3> neighbour{x, y, z};
          neighbour[face / 2] += face % 2 ? 1 : -1;
          if (solid(neighbour)) continue;
          Quad quad;
          for (int k = 0; k < 4; ++k) {
            const int corner = static_cast<int>(kBoxFaces[face][k]);
            quad[k] = vertex({x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)});
          }
          add_quad(object, quad);
        }
      }
}

}  // namespace pvsfarm

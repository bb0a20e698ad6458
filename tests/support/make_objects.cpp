#include "tests/support/make_objects.hpp"

#include <array>
#include <utility>
#include <vector>

#include "common/base/check.hpp"

namespace pvsfarm {
namespace {

// Corners of the six faces, counter-clockwise seen from outside: -x, +x, -y, +y, -z, +z.
constexpr std::array<std::array<int, 4>, 6> kFaces{
    {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};

}  // namespace

void set_role(SourceObject& object, Role role) {
  object.occluder = role != Role::kOnlyOccluded;
  object.occludee = role != Role::kOnlyOccludes;
}

SourceObject box_object(std::string name, const Box& box, Role role) {
  int flat_axis = -1, flat_axes = 0;
  for (int a = 0; a < 3; ++a)
    if (box.lo[a] == box.hi[a]) flat_axis = a, ++flat_axes;
  PVS_CHECK_LE(flat_axes, 1);

  SourceObject object;
  object.name = std::move(name);
  for (int face = 0; face < 6; ++face) {
    if (flat_axes == 1 && face != 2 * flat_axis + 1) continue;
    std::vector<Vec3> corners;
    for (int k : kFaces[face]) corners.push_back(box.corner(k));
    if (flat_axes == 1) {
      append(object, polygon_object("", corners));
      continue;
    }
    if (object.vertices.empty())
      for (int k = 0; k < 8; ++k) object.vertices.push_back(box.corner(k));
    const auto& f = kFaces[face];
    const auto index = [&](int i) { return static_cast<std::uint32_t>(f[i]); };
    object.triangles.push_back({index(0), index(1), index(2)});
    object.triangles.push_back({index(0), index(2), index(3)});
  }
  set_role(object, role);
  return object;
}

SourceObject polygon_object(std::string name, std::span<const Vec3> points, Role role) {
  PVS_CHECK_LE(3u, points.size());
  SourceObject object;
  object.name = std::move(name);
  object.vertices.assign(points.begin(), points.end());
  for (std::uint32_t k = 2; k < points.size(); ++k) object.triangles.push_back({0, k - 1, k});
  set_role(object, role);
  return object;
}

void append(SourceObject& object, const SourceObject& part) {
  const auto base = static_cast<std::uint32_t>(object.vertices.size());
  object.vertices.insert(object.vertices.end(), part.vertices.begin(), part.vertices.end());
  for (const auto& t : part.triangles)
    object.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
}

Box box_of(const SourceObject& object) {
  Box box;
  for (const Vec3& v : object.vertices) box.add(v);
  return box;
}

}  // namespace pvsfarm

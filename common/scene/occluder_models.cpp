#include "common/scene/occluder_models.hpp"

#include <optional>

namespace pvsfarm {
namespace {

// An axis-aligned box: eight points, two values a coordinate, twelve triangles.
std::optional<Box> as_box(const Mesh& mesh) {
  if (mesh.vertices.size() != 8 || mesh.triangles.size() != 12) return std::nullopt;
  Box box;
  for (const Vec3& p : mesh.vertices) box.add(p);
  for (const Vec3& p : mesh.vertices)
    for (int a = 0; a < 3; ++a)
      if (p[a] != box.lo[a] && p[a] != box.hi[a]) return std::nullopt;
  return box;
}

}  // namespace

void model_occluders(const Mesh& mesh, ObjectId owner, bool two_sided, double ground,
                     OccluderSet& set) {
  std::int32_t solid = -1;
  if (const std::optional<Box> box = as_box(mesh); box && two_sided) {
    Occluder kind;
    kind.shape = OccluderShape::kSolid;
    kind.is_box = kind.is_prism = 1;
    if (box->lo.z <= ground) kind.base_points = 4;
    std::array<Vec3, 8> corners;
    for (int k = 0; k < 8; ++k) corners[k] = box->corner(k);
    solid = set.add(kind, corners, {&owner, 1});
  }
  for (const MeshTriangle& t : mesh.triangles) {
    const std::array<Vec3, 3> p{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
    if (cross(p[1] - p[0], p[2] - p[0]) == Vec3(0.0)) continue;
    Occluder kind;
    kind.one_sided = !two_sided;
    kind.face_of = solid;
    set.add(kind, p, {&owner, 1});
  }
}

}  // namespace pvsfarm

#include "common/scene/mesh.hpp"

#include <algorithm>
#include <numeric>

namespace pvsfarm {

Mesh weld(const SourceObject& object) {
  const std::size_t count = object.vertices.size();
  std::vector<Vec3> positions(object.vertices);
  for (Vec3& p : positions) p += Vec3(0.0);  // -0 + 0 is 0

  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&positions](std::uint32_t a, std::uint32_t b) {
    const Vec3 &p = positions[a], &q = positions[b];
    if (p.x != q.x) return p.x < q.x;
    if (p.y != q.y) return p.y < q.y;
    if (p.z != q.z) return p.z < q.z;
    return a < b;
  });
  std::vector<std::uint32_t> first_equal(count);
  for (std::size_t i = 0; i < count; ++i) {
    const bool repeats = i > 0 && positions[order[i]] == positions[order[i - 1]];
    first_equal[order[i]] = repeats ? first_equal[order[i - 1]] : order[i];
  }

  Mesh mesh;
  std::vector<std::uint32_t> welded_from_source(count);
  for (std::uint32_t v = 0; v < count; ++v) {
    if (first_equal[v] == v) {
      welded_from_source[v] = static_cast<std::uint32_t>(mesh.vertices.size());
      mesh.vertices.push_back(positions[v]);
    } else {
      welded_from_source[v] = welded_from_source[first_equal[v]];
    }
  }
  mesh.triangles.reserve(object.triangles.size());
  for (const auto& t : object.triangles)
    mesh.triangles.push_back(
        {welded_from_source[t[0]], welded_from_source[t[1]], welded_from_source[t[2]]});
  return mesh;
}

}  // namespace pvsfarm

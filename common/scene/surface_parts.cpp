#include "common/scene/surface_parts.hpp"

#include <algorithm>
#include <numeric>

#include "common/geometry/box.hpp"

namespace pvsfarm {
namespace {

constexpr double kMaxReflexSine = 1e-6;  // of a fold that counts as straight

void number_parts(const std::vector<EdgeUse>& uses, SurfaceParts& parts) {
  std::vector<std::uint32_t> parent(parts.of_sheet.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root_of = [&parent](std::uint32_t s) {
    while (parent[s] != s) s = parent[s] = parent[parent[s]];
    return s;
  };
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first + 1; i < last; ++i) {
      const std::uint32_t a = root_of(uses[first].sheet), b = root_of(uses[i].sheet);
      parent[std::max(a, b)] = std::min(a, b);
    }
  });
  for (std::uint32_t s = 0; s < parent.size(); ++s) {
    const std::uint32_t root = root_of(s);
    if (root == s) parts.parts.emplace_back();
    parts.of_sheet[s] =
        root == s ? static_cast<std::uint32_t>(parts.parts.size() - 1) : parts.of_sheet[root];
  }
}

// Twice the area, along the normal of the side that looks away from `middle`.
Vec3 outward_area(const SheetMesh& mesh, const Sheet& sheet, const Vec3& middle) {
  const Vec3& a = mesh.vertices[sheet.v[0]];
  const Vec3 area = cross(mesh.vertices[sheet.v[1]] - a, mesh.vertices[sheet.v[2]] - a);
  return dot(area, a - middle) < 0 ? -area : area;
}

// The fold between two triangles of an edge bends away from `middle`, or not at all.
bool bends_outwards(const SheetMesh& mesh, const Sheet& s, const Sheet& t, const Vec3& middle) {
  const Vec3 area = outward_area(mesh, s, middle);
  for (const std::uint32_t v : t.v) {
    const Vec3 way = mesh.vertices[v] - mesh.vertices[s.v[0]];
    if (dot(area, way) > kMaxReflexSine * length(area) * length(way)) return false;
  }
  return true;
}

std::vector<Vec3> middles_of(const SheetMesh& mesh, const SurfaceParts& parts) {
  std::vector<Box> boxes(parts.parts.size());
  for (std::size_t s = 0; s < mesh.sheets.size(); ++s)
    for (const std::uint32_t v : mesh.sheets[s].v) boxes[parts.of_sheet[s]].add(mesh.vertices[v]);
  std::vector<Vec3> middles;
  for (const Box& box : boxes) middles.push_back(box.center());
  return middles;
}

}  // namespace

SurfaceParts find_parts(const SheetMesh& mesh, const std::vector<EdgeUse>& uses) {
  SurfaceParts parts;
  parts.of_sheet.resize(mesh.sheets.size());
  number_parts(uses, parts);
  const std::vector<Vec3> middles = middles_of(mesh, parts);
  for (std::size_t s = 0; s < mesh.sheets.size(); ++s) {
    const std::uint32_t part = parts.of_sheet[s];
    parts.parts[part].area += length(outward_area(mesh, mesh.sheets[s], middles[part])) / 2;
    ++parts.parts[part].sheets;
  }
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    const std::uint32_t part = parts.of_sheet[uses[first].sheet];
    bool& is_convex = parts.parts[part].is_convex;
    if (!is_convex) return;
    const Sheet &s = mesh.sheets[uses[first].sheet], &t = mesh.sheets[uses[last - 1].sheet];
    is_convex = last - first == 2 && bends_outwards(mesh, s, t, middles[part]) &&
                bends_outwards(mesh, t, s, middles[part]);
  });
  return parts;
}

}  // namespace pvsfarm

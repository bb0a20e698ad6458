#include "common/scene/surface_weld.hpp"

#include <algorithm>
#include <tuple>

#include "common/geometry/box.hpp"
#include "common/geometry/collinear.hpp"

namespace pvsfarm {
namespace {

bool is_before(const Vec3& a, const Vec3& b) {
  return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

// The vertices of all inputs one after the other, each joined to its equals.
struct Welded {
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> from_input;
};

// Along a space-filling curve, so that what is near in space is near in memory.
Welded weld_vertices(std::span<const SurfaceInput> inputs) {
  struct Place {
    std::uint64_t morton;
    Vec3 position;
    std::uint32_t from;
  };
  Box bounds;
  std::vector<Place> places;
  for (const SurfaceInput& input : inputs)
    for (const Vec3& p : input.mesh->vertices) {
      bounds.add(p);
      places.push_back({0, p, static_cast<std::uint32_t>(places.size())});
    }
  for (Place& place : places) place.morton = morton_code(place.position, bounds);
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
    return a.morton != b.morton ? a.morton < b.morton : is_before(a.position, b.position);
  });
  Welded welded;
  welded.from_input.resize(places.size());
  for (const Place& place : places) {
    if (welded.vertices.empty() || welded.vertices.back() != place.position)
      welded.vertices.push_back(place.position);
    welded.from_input[place.from] = static_cast<std::uint32_t>(welded.vertices.size() - 1);
  }
  return welded;
}

}  // namespace

Sheet Sheet::of(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t sides,
                std::uint32_t outer) {
  bool turned = false;
  const auto swap = [&turned](std::uint32_t& p, std::uint32_t& q) {
    if (p < q) return;
    std::swap(p, q);
    turned = !turned;
  };
  swap(a, b);
  swap(b, c);
  swap(a, b);
  const auto seen = [&turned](std::uint32_t bits) {
    return turned ? ((bits & kAscending) << 1 | (bits & kDescending) >> 1) : bits;
  };
  return {{a, b, c}, seen(sides), seen(outer)};
}

void sort_sheets(std::vector<Sheet>& sheets) {
  const auto key = [](const Sheet& s) { return std::tie(s.v[0], s.v[1], s.v[2]); };
  std::sort(sheets.begin(), sheets.end(),
            [&](const Sheet& a, const Sheet& b) { return key(a) < key(b); });
  std::size_t kept = 0;
  for (const Sheet& sheet : sheets) {
    if (kept > 0 && key(sheets[kept - 1]) == key(sheet)) {
      sheets[kept - 1].sides |= sheet.sides;
      sheets[kept - 1].outer |= sheet.outer;
    } else {
      sheets[kept++] = sheet;
    }
  }
  sheets.resize(kept);
}

void drop_party_walls(std::vector<Sheet>& sheets) {
  std::erase_if(sheets, [](const Sheet& sheet) { return sheet.outer == Sheet::kBoth; });
}

SheetMesh weld_surfaces(std::span<const SurfaceInput> inputs) {
  Welded welded = weld_vertices(inputs);
  SheetMesh mesh;
  mesh.vertices = std::move(welded.vertices);
  std::size_t base = 0;
  for (const SurfaceInput& input : inputs) {
    const std::uint32_t sides = input.two_sided ? Sheet::kBoth : Sheet::kAscending;
    for (const MeshComponent& component : input.components)
      for (const MeshTriangle& t : component.triangles) {
        const std::uint32_t a = welded.from_input[base + t[0]], b = welded.from_input[base + t[1]],
                            c = welded.from_input[base + t[2]];
        if (!is_collinear(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]))
          mesh.sheets.push_back(
              Sheet::of(a, b, c, sides, component.closed_outward ? Sheet::kAscending : 0));
      }
    base += input.mesh->vertices.size();
  }
  sort_sheets(mesh.sheets);
  return mesh;
}

}  // namespace pvsfarm

// The triangles of many objects as one: vertices joined where they are equal exactly, every piece
// of matter once.
#pragma once

#include <span>
#include <vector>

#include "common/scene/mesh_components.hpp"

namespace pvsfarm {

// An opaque, static object.
struct SurfaceInput {
  const Mesh* mesh = nullptr;
  std::vector<MeshComponent> components;  // of the mesh
  bool two_sided = true;
};

// A triangle with its vertices ascending, so that the same triangle is the same record.
struct Sheet {
  // Bits of `sides`: it blocks rays that meet the side that sees its vertices counter-clockwise in
  // ascending order, or the other.
  static constexpr std::uint32_t kAscending = 1, kDescending = 2, kBoth = 3;
  // The same bits of `outer`: a closed solid lies behind the triangle as seen from there.

  std::uint32_t v[3];
  std::uint32_t sides : 2;
  std::uint32_t outer : 2;

  // Of a triangle in any order, the bits as seen in that order.
  static Sheet of(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t sides,
                  std::uint32_t outer);
  // The part between three points of this triangle that turn as v[0], v[1], v[2] do.
  Sheet part(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    return of(a, b, c, sides, outer);
  }
};

struct SheetMesh {
  std::vector<Vec3> vertices;  // each position once, near ones near each other
  std::vector<Sheet> sheets;   // ascending, each triangle once; none degenerate
};

// Sorts `sheets`, and joins the bits of those that are the same triangle.
void sort_sheets(std::vector<Sheet>& sheets);

// Where two closed solids touch with the same triangle, a party wall, it is left out: it lies
// within matter, and an edge that it ends at would have three triangles. Rays meet what is around
// it.
void drop_party_walls(std::vector<Sheet>& sheets);

// The same whatever the order of the inputs, of their vertices and triangles. Party walls are in
// it.
SheetMesh weld_surfaces(std::span<const SurfaceInput> inputs);

}  // namespace pvsfarm

// The triangles of many objects as one: vertices joined where they are equal exactly, every piece
// of matter once.
#pragma once

#include <span>
#include <vector>

#include "common/scene/mesh.hpp"

namespace pvsfarm {

// An opaque, static object, as its mesh.
struct SurfaceInput {
  const Mesh* mesh = nullptr;
  bool two_sided = true;
};

// A triangle with its vertices ascending, so that the same triangle is the same record.
struct Sheet {
  // Bits of `sides`: it blocks rays that meet the side that sees its vertices counter-clockwise in
  // ascending order, or the other.
  static constexpr std::uint32_t kAscending = 1, kDescending = 2, kBoth = 3;

  std::uint32_t v[3];
  std::uint32_t sides;

  // Of a triangle in any order, `sides` as seen in that order.
  static Sheet of(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t sides);
};

struct SheetMesh {
  std::vector<Vec3> vertices;  // each position once, near ones near each other
  std::vector<Sheet> sheets;   // ascending, each triangle once; none degenerate
};

// Sorts `sheets`, and joins the sides of those that are the same triangle.
void sort_sheets(std::vector<Sheet>& sheets);

// The same whatever the order of the inputs, of their vertices and triangles.
SheetMesh weld_surfaces(std::span<const SurfaceInput> inputs);

}  // namespace pvsfarm

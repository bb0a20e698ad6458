// Renders which triangle is the nearest at every pixel of a view, with OSMesa.
//
// A view is one side of a cube around the eye: 90 degrees wide, so that six show everything.
// Depth is a 32-bit float that falls with distance (near / distance), without a far plane.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

namespace pvsfarm {

// A corner of a triangle relative to the eye, [units] any, and the triangle's item.
struct ItemVertex {
  float x, y, z;
  std::uint32_t item;  // below kNoItem
};
inline constexpr std::uint32_t kNoItem = 0xffffffffu;

// Looks along axis 0, 1 or 2 in the direction of sign; right and up are the next two axes.
struct ItemView {
  int axis = 0;
  float sign = 1;
};

class ItemBuffer {
 public:
  // A square target with an OpenGL context of its own; see OsmesaContext for threads.
  explicit ItemBuffer(int side_px);
  ~ItemBuffer();

  int side_px() const;
  // Draws triangles, three vertices each, both sides; what is nearer to the eye than `near` is not
  // drawn. Returns the item of the nearest triangle a pixel, row by row, kNoItem where there is
  // none. Pixel (i, j) looks along sign * e(axis) + x(i) e(axis + 1) + x(j) e(axis + 2) with
  // x(i) = (2 i + 1) / side_px - 1. Valid until the next draw.
  std::span<const std::uint32_t> draw(const ItemView& view, float near,
                                      std::span<const ItemVertex> triangles);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm

#include "worker/render/item_buffer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <vector>

namespace pvsfarm {
namespace {

constexpr int kSide = 32;
constexpr float kNear = 0.01f;

// A point in direction sign * e(axis) + x e(axis + 1) + y e(axis + 2), `distance` along the axis.
ItemVertex vertex(const ItemView& view, float distance, float x, float y, std::uint32_t item) {
  std::array<float, 3> p{};
  p[static_cast<std::size_t>(view.axis)] = view.sign * distance;
  p[static_cast<std::size_t>((view.axis + 1) % 3)] = x * distance;
  p[static_cast<std::size_t>((view.axis + 2) % 3)] = y * distance;
  return {p[0], p[1], p[2], item};
}

// Covers x + y < sum of the view, far beyond its borders.
void add_half(const ItemView& view, float distance, float sum, std::uint32_t item,
              std::vector<ItemVertex>& out) {
  out.push_back(vertex(view, distance, -9, sum + 9, item));
  out.push_back(vertex(view, distance, -9, -9, item));
  out.push_back(vertex(view, distance, sum + 9, -9, item));
}

TEST(ItemBuffer, each_of_six_views_shows_the_nearest_item_at_every_pixel) {
  ItemBuffer buffer(kSide);
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {-1.0f, 1.0f}) {
      const ItemView view{axis, sign};
      std::vector<ItemVertex> triangles;
      add_half(view, 1000, 0.51f, 7, triangles);  // far, in front of nothing beyond x + y = 0.51
      add_half(view, 2, -0.49f, 4'000'000'000u, triangles);  // near, the lower left part
      add_half({axis, -sign}, 1, 9, 3, triangles);           // behind the eye
      const auto pixels = buffer.draw(view, kNear, triangles);
      for (int j = 0; j < kSide; ++j) {
        for (int i = 0; i < kSide; ++i) {
          const float x = (2 * i + 1.0f) / kSide - 1, y = (2 * j + 1.0f) / kSide - 1;
          const std::uint32_t expected = x + y < -0.49f  ? 4'000'000'000u
                                         : x + y < 0.51f ? 7
                                                         : kNoItem;
          ASSERT_EQ(pixels[static_cast<std::size_t>(j * kSide + i)], expected)
              << "axis " << axis << " sign " << sign << " pixel " << i << ", " << j;
        }
      }
    }
  }
}

TEST(ItemBuffer, what_is_nearer_than_near_is_not_drawn_and_the_last_draw_is_forgotten) {
  ItemBuffer buffer(kSide);
  std::vector<ItemVertex> triangles;
  add_half({0, 1}, kNear / 2, 9, 1, triangles);
  add_half({0, 1}, 50, 9, 2, triangles);
  for (const std::uint32_t item : buffer.draw({0, 1}, kNear, triangles)) ASSERT_EQ(item, 2u);
  for (const std::uint32_t item : buffer.draw({0, 1}, kNear, {})) ASSERT_EQ(item, kNoItem);
}

}  // namespace
}  // namespace pvsfarm

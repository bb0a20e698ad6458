#include "worker/render/min_depth_target.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace pvsfarm {
namespace {

constexpr float kInfinity = INFINITY;

// The lower left triangle of a square of `side_px`, the pixel centres on its diagonal left out.
std::array<WindowVertex, 3> lower_left(float side_px, float depth) {
  const float cut = side_px - 0.25f;
  return {WindowVertex{0, 0, depth}, WindowVertex{cut, 0, depth}, WindowVertex{0, cut, depth}};
}

void expect_lower_left(std::span<const float> pixels, std::size_t side_px, float depth) {
  ASSERT_EQ(pixels.size(), side_px * side_px);
  for (std::size_t y = 0; y < side_px; ++y)
    for (std::size_t x = 0; x < side_px; ++x)
      ASSERT_EQ(pixels[y * side_px + x], x + y + 1 < side_px ? depth : kInfinity)
          << "pixel " << x << ", " << y << " of " << side_px;
}

TEST(MinDepthTarget, keeps_the_least_depth_exactly_and_forgets_the_last_draw) {
  MinDepthTarget target(16);
  const float near = 0.1f, far = 1e30f;
  std::vector<WindowVertex> triangles;
  for (const float depth : {far, near, far}) {
    const auto triangle = lower_left(16, depth);
    triangles.insert(triangles.end(), triangle.begin(), triangle.end());
  }
  expect_lower_left(target.draw(triangles), 16, near);
  expect_lower_left(target.draw(lower_left(16, far)), 16, far);
}

TEST(MinDepthTarget, two_in_one_process_do_not_draw_into_each_other) {
  MinDepthTarget small(16);
  std::optional<MinDepthTarget> large(std::in_place, 64);
  for (const float depth : {3.0f, 5.0f}) {
    expect_lower_left(small.draw(lower_left(16, depth)), 16, depth);
    expect_lower_left(large->draw(lower_left(64, depth + 1)), 64, depth + 1);
  }
  large.reset();  // was the last to draw
  expect_lower_left(small.draw(lower_left(16, 7)), 16, 7);
}

}  // namespace
}  // namespace pvsfarm

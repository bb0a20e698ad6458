#include <gtest/gtest.h>

#include "common/cells/cell.hpp"

namespace pvsfarm {

// Case 51: child boxes tile the parent bit for bit, however deep.
TEST(Cell, halves_share_the_split_coordinate_bit_for_bit) {
  Cell cell = Cell::aligned({{0.1, 1e7 + 0.3, -2}, {5.3, 1e7 + 9.1, -1.7}});
  for (int depth = 0; depth < 40; ++depth) {
    const int axis = cell.longest_axis();
    ASSERT_TRUE(can_split(cell, axis));
    const auto [low, high] = split(cell, axis);
    EXPECT_EQ(low.hi[axis], high.lo[axis]);
    EXPECT_EQ(low.lo, cell.lo);
    EXPECT_EQ(high.hi, cell.hi);
    cell = depth % 2 ? low : high;
  }
}

TEST(Cell, bounds_of_a_turned_cell_hold_its_corners) {
  Cell cell{.origin = {1e6, -3, 2},
            .axes = {Vec3{0.6, 0.8, 0}, Vec3{-0.8, 0.6, 0}, Vec3{0, 0, 1}},
            .lo = {-2, -1, -0.5},
            .hi = {2, 1, 0.5}};
  for (int k = 0; k < 8; ++k) EXPECT_TRUE(cell.bounds().contains(cell.corner(k)));
}

}  // namespace pvsfarm

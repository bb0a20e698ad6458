// The frame of a cell: what is around a box or a point in it holds them, wherever the cell is.
#include <gtest/gtest.h>

#include <cmath>

#include "common/base/random.hpp"
#include "worker/visibility/cell_frame.hpp"

namespace pvsfarm {
namespace {

Vec3 random_point(Random& random, double reach) {
  return {random.between(-reach, reach), random.between(-reach, reach),
          random.between(-reach, reach)};
}

Cell turned_cell(const Vec3& origin, Random& random) {
  const double angle = random.between(0, 7), tilt = random.between(0, 7);
  const double c = std::cos(angle), s = std::sin(angle), u = std::cos(tilt), v = std::sin(tilt);
  Cell cell{.origin = origin, .lo = Vec3(-1), .hi = Vec3(1)};
  cell.axes = {Vec3{c, s, 0}, Vec3{-s * u, c * u, v}, Vec3{s * v, -c * v, u}};
  return cell;
}

// Boxes as thin as coordinates are apart: the middle of two is not a number between them.
TEST(CellFrame, a_box_around_a_box_far_from_the_origin_holds_its_corners) {
  Random random(11);
  for (const double far : {0.0, 1e5, 1e9, 1e12})
    for (int k = 0; k < 300; ++k) {
      const Vec3 origin = random_point(random, far);
      const Cell cell =
          k % 4 == 0 ? Cell::aligned({origin, origin + Vec3(1)}) : turned_cell(origin, random);
      const CellFrame frame(cell);
      Box box;
      box.add(origin + random_point(random, 10));
      Vec3 other = box.lo;
      for (int a = 0; a < 3; ++a)
        for (std::uint64_t step = random.below(4); step > 0; --step)
          other[a] = std::nextafter(other[a], HUGE_VAL);
      box.add(k % 2 == 0 ? other : other + random_point(random, 5));
      const Box around = frame.local_around_world(box);
      for (int c = 0; c < 8; ++c) {
        EXPECT_TRUE(around.contains(frame.local_from_world(box.corner(c)))) << far << ' ' << k;
        const Box near = frame.local_around_point(box.corner(c));
        EXPECT_TRUE(near.contains(frame.local_from_world(box.corner(c)))) << far << ' ' << k;
      }
    }
}

}  // namespace
}  // namespace pvsfarm

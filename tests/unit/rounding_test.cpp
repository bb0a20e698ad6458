// Directed rounding to float: the nearest float on the safe side, never the other.
#include "common/geometry/rounding.hpp"

#include <gtest/gtest.h>

#include "common/base/random.hpp"

namespace pvsfarm {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

void expect_tight(double v) {
  const float up = float_not_below(v), down = float_not_above(v);
  EXPECT_GE(static_cast<double>(up), v);
  EXPECT_LE(static_cast<double>(down), v);
  EXPECT_LT(static_cast<double>(std::nextafter(up, -kInfinity)), v);
  EXPECT_GT(static_cast<double>(std::nextafter(down, kInfinity)), v);
}

TEST(Rounding, is_the_nearest_float_on_the_safe_side) {
  for (const double v :
       {0.1, -0.1, 1.0 / 3, 16777217.0, -16777217.0, 1e-40, -1e-40, 3.4e38, 1e-300})
    expect_tight(v);
  Random random(7);
  for (int i = 0; i < 100'000; ++i) expect_tight(random.between(-1, 1) * random.between(0, 1e6));
}

TEST(Rounding, keeps_what_a_float_holds) {
  for (const double v : {0.0, 1.0, -2.5, 16777216.0}) {
    EXPECT_EQ(static_cast<double>(float_not_below(v)), v);
    EXPECT_EQ(static_cast<double>(float_not_above(v)), v);
  }
}

TEST(Rounding, beyond_the_largest_float_goes_to_infinity_on_one_side_only) {
  EXPECT_EQ(float_not_below(1e39), kInfinity);
  EXPECT_EQ(float_not_above(1e39), std::numeric_limits<float>::max());
  EXPECT_EQ(float_not_above(-1e39), -kInfinity);
  EXPECT_EQ(float_not_below(-1e39), std::numeric_limits<float>::lowest());
}

}  // namespace
}  // namespace pvsfarm

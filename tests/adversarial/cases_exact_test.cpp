// The answers that cases.json expects are proved here, in exact arithmetic, before any evaluator is
// measured by them.
#include <gtest/gtest.h>

#include "tests/adversarial/case_file.hpp"

namespace pvsfarm {
namespace {

class ExactCase : public testing::TestWithParam<VisibilityCase> {};

TEST_P(ExactCase, answer_is_true) {
  const VisibilityCase& c = GetParam();
  const auto matter = exact_matter(c);
  if (c.must == Must::kVisible) {
    ASSERT_TRUE(c.witness);
    const auto& [from, to] = *c.witness;
    EXPECT_TRUE(c.cell.contains(from));
    EXPECT_TRUE(c.occludee.contains(to));
    if (from != to) {
      EXPECT_EQ(sight(matter, exact(from), exact(to)), Sight::kClear);
    }
    return;
  }
  EXPECT_FALSE(c.witness);
  if (c.must == Must::kHidden) {
    bool proved = false;
    for (const ExactPolygon& polygon : matter) proved |= hides(polygon, c.cell, c.occludee);
    EXPECT_TRUE(proved) << "no single occluder hides it";
    return;
  }
  // EITHER: no witness on a lattice of corners, edges, faces and insides.
  const auto lattice = [](const Box& box) {
    std::vector<ExactPoint> points;
    for (int i = 0; i < 125; ++i) {
      ExactPoint p;
      const ExactPoint lo = exact(box.lo), hi = exact(box.hi);
      for (int a = 0, k = i; a < 3; ++a, k /= 5)
        p.v[a] = lo.v[a] + (hi.v[a] - lo.v[a]) * (k % 5) / 4;
      points.push_back(p);
    }
    return points;
  };
  for (const ExactPoint& from : lattice(c.cell))
    for (const ExactPoint& to : lattice(c.occludee))
      ASSERT_EQ(sight(matter, from, to), Sight::kBlocked);
}

std::string name_of(const testing::TestParamInfo<VisibilityCase>& test) { return test.param.id; }

INSTANTIATE_TEST_SUITE_P(Cases, ExactCase, testing::ValuesIn(all_cases()), name_of);

}  // namespace
}  // namespace pvsfarm

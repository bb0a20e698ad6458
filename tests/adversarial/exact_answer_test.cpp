// Scenes with an exact answer: behind one convex occluder an object is hidden exactly when every
// segment from a vertex of the cell to a vertex of its box meets the occluder (Cohen-Or 1998). The
// evaluator must agree wherever the answer does not hang on a few pixels, and never hide too much.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/support/evaluation.hpp"
#include "tests/support/make_objects.hpp"

namespace pvsfarm {
namespace {

bool segment_meets(const Box& box, const Vec3& a, const Vec3& b) {
  double from = 0, to = 1;
  for (int k = 0; k < 3; ++k) {
    const double d = b[k] - a[k];
    if (d == 0) {
      if (a[k] < box.lo[k] || a[k] > box.hi[k]) return false;
      continue;
    }
    const double t0 = (box.lo[k] - a[k]) / d, t1 = (box.hi[k] - a[k]) / d;
    from = std::max(from, std::min(t0, t1));
    to = std::min(to, std::max(t0, t1));
  }
  return from <= to;
}

bool hidden_exactly(const Box& wall, const Cell& cell, const Box& object) {
  for (int v = 0; v < 8; ++v)
    for (int m = 0; m < 8; ++m)
      if (!segment_meets(wall, cell.corner(v), object.corner(m))) return false;
  return true;
}

// Within 45 degrees of the face towards the wall, where one plane's map must hold all of it.
bool before_the_face(const Cell& cell, const Box& box) {
  const double beyond = box.lo.x - cell.hi.x;
  for (const int a : {1, 2})
    if (box.hi[a] - cell.lo[a] > beyond || cell.hi[a] - box.lo[a] > beyond) return false;
  return true;
}

Box grown(const Box& box, double by) { return {box.lo - Vec3(by), box.hi + Vec3(by)}; }

struct Tally {
  int hidden = 0, visible = 0, near_the_edge = 0;
};

// Small boxes all over the space behind the wall; its own place decides what each must be.
Tally judge(const Box& wall, const Cell& cell, double lowest_z, RasterKind raster,
            const std::vector<Box>& also = {}) {
  // Four pixels of a map of 256 at extent 1.1, seen from the cell.
  constexpr double kSlack = 4 * 2.2 / 256;
  SceneSource source;
  source.objects.push_back(box_object("wall", wall, Role::kOnlyOccludes));
  for (const Box& box : also)
    source.objects.push_back(box_object("other", box, Role::kOnlyOccludes));
  const std::size_t occluders = source.objects.size();
  std::vector<Box> boxes;
  for (double x = wall.hi.x + 2; x < 90; x *= 1.35)
    for (double y = -2.1 * x; y <= 2.1 * x; y += 0.15 * x)
      for (double z = std::max(lowest_z, -2.1 * x); z <= 2.1 * x; z += 0.15 * x) {
        boxes.push_back({{x, y, z}, {x + 0.5, y + 0.5, z + 0.5}});
        source.objects.push_back(
            box_object("thing" + std::to_string(boxes.size()), boxes.back(), Role::kOnlyOccluded));
      }
  Evaluation evaluation(source, provers_only(raster));
  const auto hidden = evaluation.hidden_from(cell);
  Tally tally;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const bool says_hidden = std::binary_search(hidden.begin(), hidden.end(), i + occluders);
    const double slack = kSlack * length(boxes[i].center());
    Box with_slack = grown(boxes[i], slack);
    with_slack.lo.z = std::max(with_slack.lo.z, lowest_z);
    if (!hidden_exactly(wall, cell, boxes[i])) {
      EXPECT_FALSE(says_hidden) << "in sight: box at " << boxes[i].lo.x << " " << boxes[i].lo.y
                                << " " << boxes[i].lo.z;
      ++tally.visible;
    } else if (hidden_exactly(wall, cell, with_slack) && before_the_face(cell, with_slack)) {
      EXPECT_TRUE(says_hidden) << "well in the umbra: box at " << boxes[i].lo.x << " "
                               << boxes[i].lo.y << " " << boxes[i].lo.z;
      ++tally.hidden;
    } else {
      ++tally.near_the_edge;
    }
  }
  return tally;
}

class ExactAnswer : public testing::TestWithParam<RasterKind> {};
INSTANTIATE_TEST_SUITE_P(Both, ExactAnswer,
                         testing::Values(RasterKind::kDirect, RasterKind::kOsmesa),
                         [](const auto& test) { return std::string(to_string(test.param)); });

TEST_P(ExactAnswer, a_wall_in_the_air_hides_exactly_its_umbra) {
  const Cell cell = Cell::aligned({{-1, -1, -1}, {1, 1, 1}});
  const Tally tally = judge({{10, -12, -8}, {11, 9, 14}}, cell, -HUGE_VAL, GetParam());
  EXPECT_GT(tally.hidden, 500);
  EXPECT_GT(tally.visible, 500);
  EXPECT_LT(tally.near_the_edge, tally.hidden);
}

TEST_P(ExactAnswer, a_wall_on_the_ground_hides_down_to_the_ground) {
  const Cell cell = Cell::aligned({{-1, -1, 1.5}, {1, 1, 1.9}});
  // The exact answer sees the wall reach down for ever, as no eye and no object is below 0.
  const Box wall{{10, -15, 0}, {11, 12, 9}};
  const Tally tally = judge(wall, cell, 0, GetParam());
  EXPECT_GT(tally.hidden, 100);
  EXPECT_GT(tally.visible, 100);
}

// Its solid angle is the largest of all, and it ends a hand's breadth beyond the face.
TEST_P(ExactAnswer, a_car_below_the_cell_does_not_take_the_planes_from_the_wall) {
  const Cell cell = Cell::aligned({{-1, -1, -1}, {1, 1, 1}});
  const Box car{{-3, -0.9, -2.5}, {1.01, 0.9, -1.005}};
  const Tally tally = judge({{10, -30, -30}, {11, 30, 30}}, cell, 0, GetParam(), {car});
  EXPECT_GT(tally.hidden, 400);
}

TEST_P(ExactAnswer, a_long_cell_leaves_the_wall_a_short_umbra) {
  const Cell cell = Cell::aligned({{-4, -7, -0.2}, {2, 7, 0.2}});
  const Tally tally = judge({{6, -9, -9}, {8, 9, 9}}, cell, -HUGE_VAL, GetParam());
  EXPECT_GT(tally.hidden, 50);
  EXPECT_GT(tally.visible, 500);
}

}  // namespace
}  // namespace pvsfarm

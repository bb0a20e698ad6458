// A box on all planes of a face at once, against the same box plane by plane.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "common/base/random.hpp"
#include "worker/visibility/box_on_planes.hpp"

namespace pvsfarm {
namespace {

constexpr int kSidePx = 64;

CellFrame random_frame(Random& random) {
  Cell cell;
  for (int a = 0; a < 3; ++a) {
    cell.lo[a] = random.between(-20, 20);
    cell.hi[a] = cell.lo[a] + random.between(0, 5);
  }
  return CellFrame(cell);
}

// Rectangles of one depth, some of them nearer than what they lie on.
void draw_blocks(OcclusionMap& map, Random& random) {
  for (std::uint64_t block = random.below(12); block > 0; --block) {
    const auto i0 = static_cast<int>(random.below(kSidePx)),
               j0 = static_cast<int>(random.below(64));
    const int i1 = std::min<int>(kSidePx, i0 + 1 + static_cast<int>(random.below(48)));
    const int j1 = std::min<int>(kSidePx, j0 + 1 + static_cast<int>(random.below(48)));
    const auto depth = static_cast<float>(random.between(-10, 30));
    for (int j = j0; j < j1; ++j)
      for (int i = i0; i < i1; ++i)
        map.base()[j * kSidePx + i] = std::min(map.base()[j * kSidePx + i], depth);
  }
  map.build_pyramids();
}

std::vector<OcclusionMap> random_maps(const CellFrame& frame, Random& random) {
  std::vector<OcclusionMap> maps;
  for (const Face face : kFaces)
    for (std::uint64_t k = random.below(19); k > 0; --k) {
      maps.emplace_back().reset(
          square_plane(frame, face, random.between(0.1, 40), random.between(0.3, 2), kSidePx));
      draw_blocks(maps.back(), random);
    }
  return maps;
}

// Before, on and behind the planes, some around the cell.
Box random_box(Random& random) {
  Box box;
  for (int a = 0; a < 3; ++a) {
    box.lo[a] = random.between(-60, 60);
    box.hi[a] = box.lo[a] + (random.below(8) == 0 ? 0 : random.between(0, 20));
  }
  return box;
}

TEST(BoxOnPlanes, answers_as_a_test_plane_by_plane_does) {
  std::array<int, 3> answers{};
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Random random(seed);
    const CellFrame frame = random_frame(random);
    const std::vector<OcclusionMap> maps = random_maps(frame, random);
    for (std::size_t first = 0; first < maps.size();) {
      BoxOnPlanes planes;
      const std::size_t count = planes.set(std::span(maps).subspan(first));
      ASSERT_GE(count, 1u);
      ASSERT_LE(count, std::size_t{kMaxPlanesAtOnce});
      for (int i = 0; i < 100; ++i) {
        const Box box = random_box(random);
        planes.place(box);
        for (std::size_t k = 0; k < count; ++k) {
          const PlaneAnswer expected = test_box(maps[first + k], box);
          ASSERT_EQ(planes.answer(k), expected) << "seed " << seed << ", map " << first + k;
          ++answers[static_cast<std::size_t>(expected)];
        }
      }
      first += count;
    }
  }
  for (const int count : answers) EXPECT_GT(count, 300);  // all three were met
}

}  // namespace
}  // namespace pvsfarm

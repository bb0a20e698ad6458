// Slices of solids that are no solids, or that hold the cell, must be ignored. In integers.
#include <gtest/gtest.h>

#include "tests/adversarial/reference/slice_reference.hpp"

namespace pvsfarm::reference {
namespace {

enum Side { kLeft, kRight, kFront, kBack, kNear, kFar, kNone };  // x, y, z

// A box as a mesh, without one side.
TriangleMesh box_mesh(const IntBox& box, Side missing) {
  TriangleMesh mesh;
  const auto corners = box.corners();
  mesh.vertices.assign(corners.begin(), corners.end());
  constexpr int kSides[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (int side = 0; side < 6; ++side) {
    const auto& [a, b, c, d] = kSides[side];
    if (side == missing) continue;
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  }
  return mesh;
}

bool hides(const TriangleMesh& mesh, std::int64_t z, const IntBox& cell, const IntBox& occludee,
           SliceCheck check) {
  const auto slice = Slice::of(mesh, z, cell, check);
  return slice && slice->hides(cell, occludee);
}

bool clear(const TriangleMesh& mesh, const IntPoint& from, const IntPoint& to) {
  for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t)
    if (stab(from, to, mesh, t) != Stab::kMiss) return false;
  return true;
}

const IntBox kCell{{{-10, -10, -100}}, {{10, 10, 0}}};
const IntBox kBlock{{{-100, -100, 50}}, {{100, 100, 150}}};
constexpr std::int64_t kCut = 97;

TEST(Slice, of_a_closed_block_hides_what_stands_behind_it) {
  const IntBox behind{{{-20, -20, 200}}, {{20, 20, 210}}},
      beside{{{300, -20, 200}}, {{310, 20, 210}}};
  const TriangleMesh block = box_mesh(kBlock, kNone);
  for (const SliceCheck check : {SliceCheck::kNone, SliceCheck::kWatertightAndOutside}) {
    EXPECT_TRUE(hides(block, kCut, kCell, behind, check));
    EXPECT_FALSE(hides(block, kCut, kCell, beside, check));
  }
}

// Case 46.
TEST(Slice, with_an_open_contour_is_ignored) {
  const TriangleMesh open = box_mesh(kBlock, kLeft);
  const IntBox aside{{{-420, -20, 200}}, {{-400, 20, 210}}};
  ASSERT_TRUE(clear(open, {{0, 3, 0}}, {{-410, 1, 200}}));
  EXPECT_TRUE(hides(open, kCut, kCell, aside, SliceCheck::kNone));
  EXPECT_FALSE(hides(open, kCut, kCell, aside, SliceCheck::kWatertightAndOutside));
}

TEST(Slice, of_a_mesh_without_its_near_side_is_ignored_though_the_contour_closes) {
  const TriangleMesh open = box_mesh(kBlock, kNear);
  const IntBox within{{{-20, -20, 110}}, {{20, 20, 120}}};
  ASSERT_TRUE(clear(open, {{0, 3, 0}}, {{1, 1, 110}}));
  EXPECT_TRUE(hides(open, kCut, kCell, within, SliceCheck::kNone));
  EXPECT_FALSE(hides(open, kCut, kCell, within, SliceCheck::kWatertightAndOutside));
}

// Case 47. The rule for solids: Both/Situation.a_room_around_the_cell_does_not_hide_what_is_in_it.
TEST(Slice, of_a_room_around_the_cell_is_ignored) {
  const TriangleMesh room = box_mesh({{{-500, -500, -500}}, {{500, 500, 500}}}, kNone);
  const IntBox within{{{-20, -20, 110}}, {{20, 20, 120}}};
  ASSERT_TRUE(clear(room, {{0, 3, 0}}, {{1, 1, 110}}));
  EXPECT_TRUE(hides(room, kCut, kCell, within, SliceCheck::kNone));
  EXPECT_FALSE(hides(room, kCut, kCell, within, SliceCheck::kWatertightAndOutside));
}

TEST(Slice, of_a_solid_that_the_cell_reaches_into_is_ignored) {
  const IntBox reaching{{{-10, -10, -100}}, {{10, 10, 60}}};
  const IntBox within{{{-20, -20, 110}}, {{20, 20, 120}}};
  EXPECT_TRUE(hides(box_mesh(kBlock, kNone), kCut, reaching, within, SliceCheck::kNone));
  EXPECT_FALSE(
      hides(box_mesh(kBlock, kNone), kCut, reaching, within, SliceCheck::kWatertightAndOutside));
}

}  // namespace
}  // namespace pvsfarm::reference

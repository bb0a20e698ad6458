#include "worker/visibility/occluder_pieces.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/cells/cell.hpp"

namespace pvsfarm {
namespace {

const CellFrame kFrame(Cell::aligned({{-1, -1, -1}, {1, 1, 1}}));

LocalOccluders polygon(const std::vector<Vec3>& loop) {
  LocalOccluders all;
  LocalOccluder occluder;
  occluder.point_count = static_cast<std::uint32_t>(loop.size());
  for (const Vec3& p : loop) occluder.box.add(p);
  all.points = loop;
  all.list.push_back(occluder);
  return all;
}

// A border that runs along the cutting plane and crosses it again and again, as rounding may make
// it, has more crossings than a piece has room for.
TEST(OccluderPieces, a_border_that_wavers_about_the_cut_is_left_out) {
  const ProjectionPlane plane = square_plane(kFrame, kFaces[0], 64, 1, 64);
  const double cut = 1 + 64.0 / 64;  // x of the plane z = -D + D / 64
  std::vector<Vec3> loop{{9, 30, 5}, {9, -30, 5}};
  while (loop.size() < kMaxPiecePoints - 2) {
    const double side = loop.size() % 2 == 0 ? 1e-9 : -1e-9;
    loop.push_back({cut + side, static_cast<double>(loop.size()) - 30, 5});
  }
  const LocalOccluders all = polygon(loop);
  std::array<Piece, 2> pieces;
  pieces[1].point_count = -7;  // lies behind the first piece's points
  pieces[1].points.fill(Vec3(-7));
  EXPECT_EQ(make_pieces(all, all.list[0], plane, 0, pieces), 0);
  EXPECT_EQ(pieces[1].point_count, -7);
  EXPECT_EQ(pieces[1].points[0], Vec3(-7));
}

TEST(OccluderPieces, a_polygon_cut_once_keeps_its_order_and_names_the_cut) {
  const ProjectionPlane plane = square_plane(kFrame, kFaces[0], 64, 1, 64);
  const LocalOccluders all = polygon({{0, -3, 5}, {9, -3, 5}, {9, 3, 5}, {0, 3, 5}});
  std::array<Piece, 2> pieces;
  ASSERT_EQ(make_pieces(all, all.list[0], plane, 0, pieces), 1);
  const Piece& piece = pieces[0];
  ASSERT_EQ(piece.point_count, 4);
  ASSERT_GE(piece.cut_edges[0], 0);
  const double cut = -64 + 64.0 / 64;
  EXPECT_EQ(piece.points[piece.cut_edges[0]].z, cut);
  EXPECT_EQ(piece.points[(piece.cut_edges[0] + 1) % 4].z, cut);
  EXPECT_EQ(piece.cut_edges[1], -1);
  EXPECT_EQ(piece.box.lo.z, cut);
}

TEST(OccluderPieces, a_polygon_across_the_plane_is_a_piece_and_its_front_another) {
  const ProjectionPlane plane = square_plane(kFrame, kFaces[0], 8, 1, 64);
  // From x = 0, behind the face, to x = 20, behind the plane; corners of both cuts in all turns.
  std::vector<Vec3> loop{{0, -3, 5}, {20, -3, 5}, {20, 3, 5}, {0, 3, 5}};
  for (std::size_t turn = 0; turn < loop.size(); ++turn) {
    std::rotate(loop.begin(), loop.begin() + 1, loop.end());
    const LocalOccluders all = polygon(loop);
    std::array<Piece, 2> pieces;
    ASSERT_EQ(make_pieces(all, all.list[0], plane, 0, pieces), 2);
    const double near = -8 + 8.0 / 64;
    EXPECT_EQ(pieces[0].box.lo.z, near);
    EXPECT_EQ(pieces[0].box.hi.z, 20 - 1 - 8);
    EXPECT_EQ(pieces[0].cut_edges[1], -1);
    const Piece& front = pieces[1];
    ASSERT_EQ(front.point_count, 4);
    EXPECT_EQ(front.box.lo.z, near);
    EXPECT_EQ(front.box.hi.z, 0);
    for (const int k : {0, 1}) {
      ASSERT_GE(front.cut_edges[k], 0);
      EXPECT_EQ(front.points[front.cut_edges[k]].z, k == 0 ? near : 0);
      EXPECT_EQ(front.points[(front.cut_edges[k] + 1) % 4].z, k == 0 ? near : 0);
    }
  }
}

}  // namespace
}  // namespace pvsfarm

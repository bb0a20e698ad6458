#include "worker/visibility/occluder_pieces.hpp"

#include <gtest/gtest.h>

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
  ASSERT_GE(piece.cut_edge, 0);
  const double cut = -64 + 64.0 / 64;
  EXPECT_EQ(piece.points[piece.cut_edge].z, cut);
  EXPECT_EQ(piece.points[(piece.cut_edge + 1) % 4].z, cut);
  EXPECT_EQ(piece.box.lo.z, cut);
}

}  // namespace
}  // namespace pvsfarm

// Surfaces: what shares an edge, what must not, and that nothing but the same matter comes out.
#include <gtest/gtest.h>

#include <algorithm>

#include "common/geometry/collinear.hpp"
#include "tests/unit/surface_shapes.hpp"

namespace pvsfarm {
namespace {

// The fin keeps the cube from being a convex solid of its own.
SourceObject cube_with_a_fin() {
  return joined(box_object("cube", {Vec3(0), Vec3(1)}),
                triangles_object("fin", {{Vec3(1, 1, 0), Vec3(1, 1, 1), Vec3(2, 2, 0)}}));
}

TEST(SurfaceMesh, AConvexSolidIsLeftOut) {
  EXPECT_TRUE(scene_of({box_object("cube", {Vec3(0), Vec3(1)})})->surface_triangles().empty());
  EXPECT_TRUE(scene_of({prism_object("house", regular_ring(7, 3, {0, 0}), 0, 5, 0.4)})
                  ->surface_components()
                  .empty());
}

TEST(SurfaceMesh, ARoundSolidOfManyPointsStays) {
  const auto scene = scene_of({prism_object("tower", regular_ring(40, 3, {0, 0}), 0, 5)});
  EXPECT_EQ(scene->surface_components().size(), 1u);
  EXPECT_EQ(edges_with(*scene, 2), static_cast<int>(scene->surface_edges().size()));
}

TEST(SurfaceMesh, ACubeOfSixSquaresHasEighteenEdgesOfTwo) {
  const SourceObject cubes =
      joined(box_object("one", {Vec3(10), Vec3(14)}), box_object("two", {Vec3(14), Vec3(16)}));
  const auto scene = scene_of({joined(cube_with_a_fin(), cubes)});
  // The fin stands on an edge of the cube: that has three, the fin's others one. The other two
  // cubes touch in a corner, which is no edge, and are left out.
  EXPECT_EQ(scene->surface_triangles().size(), 13u);
  EXPECT_EQ(scene->surface_edges().size(), 20u);
  EXPECT_EQ(edges_with(*scene, 2), 17);
  EXPECT_EQ(edges_with(*scene, 3), 1);
  EXPECT_EQ(edges_with(*scene, 1), 2);
  EXPECT_EQ(scene->surface_vertices().size(), 9u);
}

TEST(SurfaceMesh, AVertexOnAnEdgeDividesTheTrianglesBeyond) {
  const auto scene = scene_of({quads_object("one", {wall(0, 4, 0, 0, 1)}),
                               quads_object("two", {wall(0, 1, 0, 1, 2), wall(1, 4, 0, 1, 2)})});
  ASSERT_EQ(scene->surface_components().size(), 1u);
  // Divided: the long edge at x = 1. Single: the outline, of which z = 0 and z = 2 give 1 + 2.
  EXPECT_EQ(scene->surface_triangles().size(), 7u);
  EXPECT_EQ(edges_with(*scene, 1), 1 + 2 + 2 + 2);
  EXPECT_EQ(edges_with(*scene, 1) + 2 * edges_with(*scene, 2), 21);
  EXPECT_DOUBLE_EQ(total_area(*scene), 8);
}

TEST(SurfaceMesh, StaggeredBricksShareEveryPieceOfTheirJoint) {
  std::vector<std::array<Vec3, 4>> bricks;
  for (int i = 0; i < 5; ++i) bricks.push_back(wall(2 * i, 2 * i + 2, 0, 0, 1));
  for (int i = 0; i < 5; ++i) bricks.push_back(wall(2 * i + 1, 2 * i + 3, 0, 1, 2));
  const auto scene = scene_of({quads_object("bricks", bricks)});
  // Open: five below, five above, two ends each, and the halves that stick out.
  EXPECT_EQ(edges_with(*scene, 1), 5 + 5 + 4 + 2);
  EXPECT_EQ(edges_with(*scene, 3), 0);
  EXPECT_DOUBLE_EQ(total_area(*scene), 20);
}

TEST(SurfaceMesh, AVertexBesideAnEdgeByABillionthLeavesItTorn) {
  const auto torn = scene_of({quads_object("one", {wall(0, 4, 0, 0, 1)}),
                              quads_object("two", {wall(0, 1, 0, 1 + 1e-9, 2)})});
  EXPECT_EQ(torn->surface_triangles().size(), 4u);
  EXPECT_EQ(edges_with(*torn, 2), 2);  // the diagonals
  const auto moved = scene_of({quads_object("one", {wall(0, 4, 0, 0, 1)}),
                               quads_object("two", {wall(4 + 1e-9, 5, 0, 0, 1)})});
  EXPECT_EQ(moved->surface_components().size(), 2u);
}

TEST(SurfaceMesh, FarFromTheOriginAnEdgeIsJudgedExactly) {
  // The point is on the line to 1 in 10^15, and one bit beside it.
  const Vec3 a(1e9 + 0.125, -3e9, 7), b = a + Vec3(3, 3 * 0x1p-20, 0), on = a + Vec3(1, 0x1p-20, 0);
  ASSERT_TRUE(is_inside_edge(on, a, b));
  Vec3 off = on;
  off.y = std::nextafter(off.y, 0.0);
  EXPECT_FALSE(is_inside_edge(off, a, b));
  for (const bool exact : {true, false}) {
    const Vec3& p = exact ? on : off;
    const auto scene = scene_of({triangles_object("one", {{a, b, a + Vec3(1, 1, 5)}}),
                                 triangles_object("two", {{b, p, a + Vec3(1, -1, -5)}})});
    EXPECT_EQ(scene->surface_triangles().size(), exact ? 3u : 0u);
    EXPECT_EQ(scene->surface_components().size(), exact ? 1u : 0u);
  }
}

TEST(SurfaceMesh, TwoRoomsInTwoObjectsShareTheirWallWithADoor) {
  // Floors of the rooms, of different depth, and between them a wall in three parts about a door.
  const auto floor = [](double x0, double x1, double y0, double y1) {
    return std::array<Vec3, 4>{Vec3(x0, y0, 0), Vec3(x1, y0, 0), Vec3(x1, y1, 0), Vec3(x0, y1, 0)};
  };
  const auto scene =
      scene_of({quads_object("first room", {floor(0, 6, -4, 0), wall(0, 2, 0, 0, 3),
                                            wall(3, 6, 0, 0, 3), wall(2, 3, 0, 2, 3)}),
                quads_object("second room", {floor(-2, 8, 0, 5)})});
  ASSERT_EQ(scene->surface_components().size(), 1u);
  // Both floors and the wall meet in 0..2 and 3..6, the floors alone in the door.
  EXPECT_EQ(edges_with(*scene, 3), 2);
  const auto at = [&](double x, double y, double z) {
    const auto vertices = scene->surface_vertices();
    return std::find(vertices.begin(), vertices.end(), Vec3(x, y, z)) - vertices.begin();
  };
  const auto uses_between = [&](std::ptrdiff_t p, std::ptrdiff_t q) {
    for (std::size_t e = 0; e < scene->surface_edges().size(); ++e) {
      const std::uint32_t* const v = scene->surface_edges()[e].vertex;
      if (v[0] == std::min(p, q) && v[1] == std::max(p, q)) return uses_of(*scene)[e];
    }
    return 0;
  };
  EXPECT_EQ(uses_between(at(2, 0, 0), at(3, 0, 0)), 2);  // under the door
  EXPECT_EQ(uses_between(at(2, 0, 0), at(2, 0, 2)), 1);  // its post
  EXPECT_EQ(uses_between(at(2, 0, 2), at(3, 0, 2)), 1);  // its lintel
  EXPECT_EQ(uses_between(at(2, 0, 2), at(2, 0, 3)), 2);  // the wall above its post
}

TEST(SurfaceMesh, WhereTwoSolidsTouchTheirPartyWallIsLeftOut) {
  // Three blocks in an L: each convex, together not.
  std::vector<SourceObject> blocks = {box_object("a", {Vec3(0, 0, 0), Vec3(1, 1, 1)}),
                                      box_object("b", {Vec3(1, 0, 0), Vec3(2, 1, 1)}),
                                      box_object("c", {Vec3(0, 1, 0), Vec3(1, 2, 1)})};
  for (const bool two_sided : {true, false}) {
    for (SourceObject& block : blocks) block.two_sided = two_sided;
    const auto scene = scene_of(blocks);
    // Ten triangles of the middle block's twelve, less those of the second wall; ten of each end.
    EXPECT_EQ(scene->surface_triangles().size(), 8u + 10u + 10u);
    ASSERT_EQ(scene->surface_components().size(), 1u);
    EXPECT_EQ(edges_with(*scene, 2), static_cast<int>(scene->surface_edges().size()));
  }
}

TEST(SurfaceMesh, ACurtainInAnOpenRoomIsNoPartyWall) {
  // The sheet is nobody's border, and each box alone is without it.
  SourceObject open_box = box_object("room", {Vec3(0, 0, 0), Vec3(1, 1, 1)});
  open_box.triangles.erase(open_box.triangles.begin(), open_box.triangles.begin() + 2);  // no floor
  const auto scene = scene_of({open_box, box_object("beside", {Vec3(1, 0, 0), Vec3(2, 1, 1)})});
  EXPECT_EQ(scene->surface_triangles().size(), 10u + 10u);
}

// Edges that two triangles run along in the same direction.
int disagreements(const Scene& scene) {
  std::vector<int> uses = uses_of(scene), along(uses.size(), 0);
  for (const SurfaceTriangle& t : scene.surface_triangles())
    for (const std::int32_t e : t.edge) along[e >= 0 ? e : ~e] += e >= 0 ? 1 : -1;
  int count = 0;
  for (std::size_t e = 0; e < uses.size(); ++e) count += uses[e] == 2 && along[e] != 0;
  return count;
}

TEST(SurfaceMesh, TwoSidedNeighboursAgreeAndSolidsLookOutwards) {
  Random random(3);
  std::vector<Vec2> ring;  // a star: not convex
  for (int i = 0; i < 20; ++i) ring.push_back(regular_ring(20, i % 2 == 0 ? 3.0 : 2.0, {0, 0})[i]);
  SourceObject star;
  for (const double z : {0.0, 5.0})
    for (const Vec2& p : ring) star.vertices.emplace_back(p.x, p.y, z);
  star.vertices.insert(star.vertices.end(), {Vec3(0, 0, 0), Vec3(0, 0, 5)});
  for (std::uint32_t i = 0; i < 20; ++i) {
    const std::uint32_t j = (i + 1) % 20;
    for (std::array<std::uint32_t, 3> t : {std::array<std::uint32_t, 3>{i, j, 20 + j},
                                           {i, 20 + j, 20 + i},
                                           {40, j, i},
                                           {41, 20 + i, 20 + j}}) {
      if (random.below(2) == 0) std::swap(t[1], t[2]);
      star.triangles.push_back(t);
    }
  }
  const auto scene = scene_of({star});
  EXPECT_EQ(scene->surface_triangles().size(), 80u);
  EXPECT_EQ(disagreements(*scene), 0);
  double volume = 0;
  for (const SurfaceTriangle& t : scene->surface_triangles())
    volume += dot(area_of(*scene, t), scene->surface_vertices()[t.vertex[0]]) / 3;
  EXPECT_GT(volume, 50);
  // Walls of several objects that turn every way.
  const auto walls =
      scene_of({quads_object("a", {wall(0, 2, 0, 0, 1)}), quads_object("b", {wall(3, 2, 0, 0, 1)}),
                quads_object("c", {wall(0, 3, 0, 2, 1)})});
  EXPECT_EQ(walls->surface_triangles().size(), 7u);
  EXPECT_EQ(disagreements(*walls), 0);
}

TEST(SurfaceMesh, TheSameTriangleTwiceIsOne) {
  const SourceObject one = quads_object("one", {wall(0, 1, 0, 0, 1)});
  SourceObject front = one;
  front.two_sided = false;
  SourceObject back = front;
  for (auto& t : back.triangles) std::swap(t[0], t[1]);
  EXPECT_EQ(scene_of({one, one})->surface_triangles().size(), 2u);
  EXPECT_EQ(scene_of({front})->surface_triangles()[0].one_sided, 1u);
  EXPECT_EQ(scene_of({one})->surface_triangles()[0].one_sided, 0u);
  EXPECT_EQ(scene_of({front, one})->surface_triangles()[0].one_sided, 0u);
  EXPECT_EQ(scene_of({front, back})->surface_triangles()[0].one_sided, 0u);
  EXPECT_EQ(scene_of({front, back})->surface_triangles().size(), 2u);
  EXPECT_EQ(scene_of({front, front})->surface_triangles()[0].one_sided, 1u);
}

TEST(SurfaceMesh, LeavesOfATreeAreLeftOut) {
  Random random(5);
  std::vector<std::array<Vec3, 3>> leaves;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 p(random.between(0, 4), random.between(0, 4), random.between(2, 9));
    leaves.push_back({p, p + Vec3(0.1, 0, random.unit()), p + Vec3(0, 0.1, random.unit())});
  }
  const auto scene = scene_of({triangles_object("leaves", leaves),
                               prism_object("trunk", regular_ring(9, 0.2, {2, 2}), 0, 3)});
  EXPECT_TRUE(scene->surface_components().empty());
  EXPECT_TRUE(scene->surface_vertices().empty());
}

TEST(SurfaceMesh, AOneSidedTriangleKeepsItsFrontWhenDivided) {
  SourceObject long_one = triangles_object("long", {{Vec3(4, 0, 0), Vec3(2, 3, 0), Vec3(0)}});
  long_one.two_sided = false;
  SourceObject other = triangles_object("other", {{Vec3(1, 0, 0), Vec3(3, 0, 0), Vec3(2, 0, 9)}});
  other.two_sided = false;
  const auto scene = scene_of({long_one, other});
  int up = 0, towards = 0;
  for (const SurfaceTriangle& t : scene->surface_triangles()) {
    EXPECT_EQ(t.one_sided, 1u);
    up += area_of(*scene, t).z > 0;
    towards += area_of(*scene, t).y < 0;
  }
  EXPECT_EQ(up, 3);
  EXPECT_EQ(towards, 1);
  EXPECT_EQ(scene->surface_triangles().size(), 4u);
}

TEST(SurfaceMesh, NeedlesAndMinusZeroAreNoMatter) {
  const auto scene =
      scene_of({triangles_object("all", {{Vec3(0), Vec3(1, 0, 0), Vec3(0, 1, 0)},
                                         {Vec3(-0.0, 0, -0.0), Vec3(1, 0, 0), Vec3(0, 0, 1)},
                                         {Vec3(0), Vec3(1, 1, 1), Vec3(3, 3, 3)},
                                         {Vec3(5), Vec3(5), Vec3(6)}})});
  EXPECT_EQ(scene->surface_triangles().size(), 2u);
  EXPECT_EQ(scene->surface_vertices().size(), 4u);
  EXPECT_EQ(edges_with(*scene, 2), 1);
}

TEST(SurfaceMesh, OnlyStaticOccludersAreSurfaces) {
  SourceObject glass = quads_object("glass", {wall(0, 1, 0, 0, 1)}), lift = glass, wire = glass;
  glass.occluder = false;
  lift.dynamic = true;
  wire.occludee = false;
  EXPECT_TRUE(scene_of({glass, lift})->surface_triangles().empty());
  EXPECT_EQ(scene_of({glass, lift, wire})->surface_triangles().size(), 2u);
}

}  // namespace
}  // namespace pvsfarm

// Surfaces: what shares an edge, what must not, and that nothing but the same matter comes out.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "common/geometry/collinear.hpp"
#include "common/scene/surface_splits.hpp"
#include "tests/unit/scene_shapes.hpp"

namespace pvsfarm {
namespace {

SourceObject triangles_object(std::string name, const std::vector<std::array<Vec3, 3>>& triangles) {
  SourceObject object;
  object.name = std::move(name);
  for (const auto& t : triangles) {
    const auto v = static_cast<std::uint32_t>(object.vertices.size());
    object.vertices.insert(object.vertices.end(), t.begin(), t.end());
    object.triangles.push_back({v, v + 1, v + 2});
  }
  return object;
}

// Counter-clockwise loops of four, each as two triangles.
SourceObject quads_object(std::string name, const std::vector<std::array<Vec3, 4>>& quads) {
  std::vector<std::array<Vec3, 3>> triangles;
  for (const auto& q : quads) {
    triangles.push_back({q[0], q[1], q[2]});
    triangles.push_back({q[0], q[2], q[3]});
  }
  return triangles_object(std::move(name), triangles);
}

// A wall in the plane y = `y`, from x0 to x1 and z0 to z1.
std::array<Vec3, 4> wall(double x0, double x1, double y, double z0, double z1) {
  return {Vec3(x0, y, z0), Vec3(x1, y, z0), Vec3(x1, y, z1), Vec3(x0, y, z1)};
}

// How many triangles each edge has.
std::vector<int> uses_of(const Scene& scene) {
  std::vector<int> uses(scene.surface_edges().size(), 0);
  for (const SurfaceTriangle& t : scene.surface_triangles())
    for (const std::int32_t e : t.edge) ++uses[e >= 0 ? e : ~e];
  return uses;
}
int edges_with(const Scene& scene, int triangles) {
  const std::vector<int> uses = uses_of(scene);
  return static_cast<int>(std::count(uses.begin(), uses.end(), triangles));
}

Vec3 area_of(const Scene& scene, const SurfaceTriangle& t) {
  const Vec3& a = scene.surface_vertices()[t.vertex[0]];
  return cross(scene.surface_vertices()[t.vertex[1]] - a,
               scene.surface_vertices()[t.vertex[2]] - a) /
         2.0;
}
double total_area(const Scene& scene) {
  double area = 0;
  for (const SurfaceTriangle& t : scene.surface_triangles()) area += length(area_of(scene, t));
  return area;
}

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

template <class T>
bool same_bytes(std::span<const T> a, std::span<const T> b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

// Random patches on a coarse lattice, so that vertices lie on edges, edges on edges.
std::vector<SourceObject> patches(Random& random, int count) {
  std::vector<SourceObject> objects;
  const auto step = [&random](int n) { return static_cast<double>(random.below(n)); };
  for (int i = 0; i < count; ++i) {
    std::vector<std::array<Vec3, 3>> triangles;
    for (int k = 0; k < 4; ++k)
      triangles.push_back({Vec3(step(5), step(5), step(2)), Vec3(step(5), step(5), step(2)),
                           Vec3(step(5), step(5), step(2))});
    objects.push_back(triangles_object("patch " + std::to_string(i), triangles));
    objects.back().two_sided = random.below(2) == 0;
  }
  return objects;
}

TEST(SurfaceMesh, TheOrderOfTheObjectsDoesNotMatter) {
  Random random(20261122);
  for (int round = 0; round < 40; ++round) {
    std::vector<SourceObject> objects = patches(random, 6);
    const auto scene = scene_of(objects);
    std::reverse(objects.begin(), objects.end());
    for (SourceObject& object : objects) {
      std::reverse(object.triangles.begin(), object.triangles.end());
      for (auto& t : object.triangles) std::rotate(t.begin(), t.begin() + 1, t.end());
    }
    const auto turned_over = scene_of(objects);
    EXPECT_TRUE(same_bytes(scene->surface_vertices(), turned_over->surface_vertices()));
    EXPECT_TRUE(same_bytes(scene->surface_edges(), turned_over->surface_edges()));
    EXPECT_TRUE(same_bytes(scene->surface_triangles(), turned_over->surface_triangles()));
  }
}

// Which of the triangles hold p, a point of their plane with integer coordinates 60 times finer.
int sides_at(const std::vector<std::array<Vec3, 4>>& faces, const Vec3& p) {
  int sides = 0;
  for (const auto& [a, b, c, mark] : faces) {
    const Vec3 normal = cross(b - a, c - a);
    if (dot(normal, p - a) != 0) continue;
    if (dot(normal, cross(b - a, p - a)) < 0 || dot(normal, cross(c - b, p - b)) < 0 ||
        dot(normal, cross(a - c, p - c)) < 0)
      continue;
    const bool up =
        normal.z > 0 || (normal.z == 0 && (normal.y > 0 || (normal.y == 0 && normal.x > 0)));
    sides |= mark.x == 0 ? 3 : (up ? 1 : 2);
  }
  return sides;
}

// A floor whose long edge from (0, 0) to (4, 0) has the neighbours' vertex beside it.
std::shared_ptr<const Scene> floor_with_neighbours(double y, bool two_sided = true) {
  const Vec3 v(1, y, 0), far(2, -3, 0);
  SourceObject floor = triangles_object("floor", {{Vec3(0), Vec3(4, 0, 0), Vec3(2, 3, 0)}});
  floor.two_sided = two_sided;
  return scene_of(
      {floor, triangles_object("others", {{Vec3(0), far, v}, {v, far, Vec3(4, 0, 0)}})});
}

TEST(SurfaceMesh, WhereATearOverlapsTheSliverIsLost) {
  const double tear = 0x1p-20;
  const auto scene = floor_with_neighbours(tear);
  ASSERT_EQ(scene->surface_components().size(), 1u);
  EXPECT_EQ(scene->surface_triangles().size(), 4u);
  EXPECT_EQ(edges_with(*scene, 1), 4);
  EXPECT_DOUBLE_EQ(total_area(*scene), 6 - 2 * tear + 6 + 2 * tear);
  int up = 0;
  const auto one_sided = floor_with_neighbours(tear, false);
  for (const SurfaceTriangle& t : one_sided->surface_triangles())
    if (t.one_sided) up += area_of(*one_sided, t).z > 0 ? 1 : 100;
  EXPECT_EQ(up, 2);
}

TEST(SurfaceMesh, WhereATearGapesOrIsWideItStays) {
  for (const double y : {-0x1p-20, -1e-12, 0.01}) {
    const auto scene = floor_with_neighbours(y);
    EXPECT_EQ(scene->surface_triangles().size(), 2u) << y;  // the neighbours: the floor is alone
  }
}

TEST(SurfaceMesh, ATearOutOfThePlaneStays) {
  const Vec3 v(1, 0x1p-20, 0x1p-40), far(2, -3, 0);
  const auto scene =
      scene_of({triangles_object("floor", {{Vec3(0), Vec3(4, 0, 0), Vec3(2, 3, 0)}}),
                triangles_object("others", {{Vec3(0), far, v}, {v, far, Vec3(4, 0, 0)}})});
  EXPECT_EQ(scene->surface_triangles().size(), 2u);
}

TEST(SurfaceMesh, MendingTearsNeverAddsMatter) {
  Random random(11);
  int mended = 0;
  for (int round = 0; round < 60; ++round) {
    // A strip of triangles with vertices on one line, and a floor along it; off by one step or two.
    const auto jitter = [&random] { return (static_cast<double>(random.below(5)) - 2) * 0x1p-20; };
    const Vec3 a(0, 0, 0), b(8, 0, 0), c(3, 4, 0);
    std::vector<std::array<Vec3, 3>> strip;
    Vec3 last = a;
    for (int i = 1; i <= 5; ++i) {
      const Vec3 next = i == 5 ? b : Vec3(1.5 * i, jitter(), 0);
      strip.push_back({last, Vec3(4, -3, 0), next});
      last = next;
    }
    const auto scene =
        scene_of({triangles_object("floor", {{a, b, c}}), triangles_object("strip", strip)});
    mended += scene->surface_triangles().size() > 6;
    for (const SurfaceTriangle& t : scene->surface_triangles()) {
      const auto at = [&](int k) { return scene->surface_vertices()[t.vertex[k]]; };
      if (at(0).y < 0 || at(1).y < 0 || at(2).y < 0) continue;  // of the strip, mostly
      for (int k = 0; k < 3; ++k) {
        EXPECT_GE(turn(a, b, at(k), 2), 0);
        EXPECT_GE(turn(b, c, at(k), 2), 0);
        EXPECT_GE(turn(c, a, at(k), 2), 0);
      }
    }
  }
  EXPECT_GT(mended, 30);
}

TEST(SurfaceMesh, DividingNeitherAddsNorLosesMatter) {
  Random random(7);
  for (int round = 0; round < 60; ++round) {
    std::vector<SourceObject> objects = patches(random, 5);
    std::vector<std::array<Vec3, 4>> before, after;
    for (const SourceObject& object : objects)
      for (const auto& t : object.triangles) {
        const Vec3 &a = object.vertices[t[0]], &b = object.vertices[t[1]],
                   &c = object.vertices[t[2]];
        if (cross(b - a, c - a) != Vec3(0.0))
          before.push_back({a * 60.0, b * 60.0, c * 60.0, Vec3(object.two_sided ? 0 : 1)});
      }
    std::vector<Mesh> meshes;
    std::vector<SurfaceInput> inputs;
    for (const SourceObject& object : objects) meshes.push_back(weld(object));
    for (std::size_t i = 0; i < objects.size(); ++i)
      inputs.push_back(
          {&meshes[i], split_components(meshes[i], objects[i].two_sided), objects[i].two_sided});
    SheetMesh mesh = weld_surfaces(inputs);
    split_edges_at_vertices(mesh);
    for (const Sheet& sheet : mesh.sheets) {
      const auto at = [&](int k) { return mesh.vertices[sheet.v[k]] * 60.0; };
      const bool ascending = (sheet.sides & Sheet::kAscending) != 0;
      after.push_back({at(0), at(ascending ? 1 : 2), at(ascending ? 2 : 1),
                       Vec3(sheet.sides == Sheet::kBoth ? 0 : 1)});
    }
    // Points of the plane of each face, most of them within it.
    for (const auto& [a, b, c, mark] : before)
      for (int k = 0; k < 40; ++k) {
        const int u = static_cast<int>(random.below(61)), v = static_cast<int>(random.below(61));
        const Vec3 p = a + (b - a) / 60.0 * double(u) + (c - a) / 60.0 * double(v);
        ASSERT_EQ(sides_at(before, p), sides_at(after, p)) << "seed 7, round " << round;
      }
  }
}

}  // namespace
}  // namespace pvsfarm

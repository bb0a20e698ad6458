// Dividing edges and mending tears: the same matter or less, whatever the order.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "common/geometry/collinear.hpp"
#include "common/scene/surface_splits.hpp"
#include "tests/unit/surface_shapes.hpp"

namespace pvsfarm {
namespace {

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

TEST(SurfaceMatter, TheOrderOfTheObjectsDoesNotMatter) {
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

TEST(SurfaceMatter, WhereATearOverlapsTheSliverIsLost) {
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

TEST(SurfaceMatter, WhereATearGapesOrIsWideItStays) {
  for (const double y : {-0x1p-20, -1e-12, 0.01}) {
    const auto scene = floor_with_neighbours(y);
    EXPECT_EQ(scene->surface_triangles().size(), 2u) << y;  // the neighbours: the floor is alone
  }
}

TEST(SurfaceMatter, ATearOutOfThePlaneStays) {
  const Vec3 v(1, 0x1p-20, 0x1p-40), far(2, -3, 0);
  const auto scene =
      scene_of({triangles_object("floor", {{Vec3(0), Vec3(4, 0, 0), Vec3(2, 3, 0)}}),
                triangles_object("others", {{Vec3(0), far, v}, {v, far, Vec3(4, 0, 0)}})});
  EXPECT_EQ(scene->surface_triangles().size(), 2u);
}

TEST(SurfaceMatter, MendingTearsNeverAddsMatter) {
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

TEST(SurfaceMatter, DividingNeitherAddsNorLosesMatter) {
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

// The perturbations do what they say: a stability test over a perturbation that changes nothing
// would pass for nothing.
#include "tests/adversarial/perturbations.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numbers>

#include "tests/support/make_objects.hpp"

namespace pvsfarm {
namespace {

// A block and a pyramid, and a cell before the block.
World small_world() {
  SceneSource source;
  source.objects = {box_object("block", {{4, -2, 0}, {6, 2, 3}}), SourceObject{}};
  SourceObject& pyramid = source.objects[1];
  pyramid.name = "pyramid";
  pyramid.vertices = {{9, -1, 0}, {11, -1, 0}, {11, 1, 0}, {9, 1, 0}, {10, 0, 2}};
  pyramid.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {0, 2, 1}, {0, 3, 2}};
  return world_of(std::move(source), {Cell::aligned({{-1, -0.5, 1}, {0, 0.5, 2}})});
}

double area(const SourceObject& object) {
  double sum = 0;
  for (const auto& t : object.triangles) {
    const Vec3 a = object.vertices[t[0]];
    sum += length(cross(object.vertices[t[1]] - a, object.vertices[t[2]] - a)) / 2;
  }
  return sum;
}

using Edge = std::array<double, 6>;
Edge edge_of(const Vec3& a, const Vec3& b) { return {a.x, a.y, a.z, b.x, b.y, b.z}; }

// Every edge, by position, is run along as often in one direction as in the other.
bool is_closed(const SourceObject& object) {
  std::map<Edge, int> uses;
  for (const auto& t : object.triangles)
    for (int k = 0; k < 3; ++k) {
      const Vec3 &a = object.vertices[t[k]], &b = object.vertices[t[(k + 1) % 3]];
      ++uses[edge_of(a, b)];
      --uses[edge_of(b, a)];
    }
  return std::all_of(uses.begin(), uses.end(), [](const auto& use) { return use.second == 0; });
}

void expect_same_surface(const World& world, std::size_t triangles_each, bool closed) {
  const World before = small_world();
  ASSERT_EQ(world.source.objects.size(), before.source.objects.size());
  for (std::size_t i = 0; i < before.source.objects.size(); ++i) {
    const SourceObject &now = world.source.objects[i], &then = before.source.objects[i];
    EXPECT_NEAR(area(now), area(then), 1e-9);
    EXPECT_EQ(now.triangles.size(), triangles_each * then.triangles.size());
    EXPECT_EQ(is_closed(now), closed);
    EXPECT_EQ(box_of(now).lo, box_of(then).lo);
    EXPECT_EQ(box_of(now).hi, box_of(then).hi);
  }
}

TEST(Perturbations, triangles_into_four_stay_closed) {
  expect_same_surface(quartered(small_world()), 4, true);
}
TEST(Perturbations, fans_stay_closed) { expect_same_surface(fanned(small_world(), 5), 15, true); }
TEST(Perturbations, slivers_stay_closed) {
  expect_same_surface(with_slivers(small_world(), 1e-6), 3, true);
}

TEST(Perturbations, t_junctions_keep_the_surface_and_open_the_mesh) {
  const World before = small_world(), world = with_t_junctions(small_world());
  for (std::size_t i = 0; i < before.source.objects.size(); ++i) {
    EXPECT_NEAR(area(world.source.objects[i]), area(before.source.objects[i]), 1e-9);
    EXPECT_FALSE(is_closed(world.source.objects[i]));
  }
}

TEST(Perturbations, duplicate_faces_double_the_area) {
  const World before = small_world(), world = with_duplicate_faces(small_world());
  for (std::size_t i = 0; i < before.source.objects.size(); ++i)
    EXPECT_NEAR(area(world.source.objects[i]), 2 * area(before.source.objects[i]), 1e-9);
}

TEST(Perturbations, jitter_moves_every_vertex_a_little_and_keeps_meshes_closed) {
  const World before = small_world(), world = jittered(small_world(), 1e-3, 7);
  for (std::size_t i = 0; i < before.source.objects.size(); ++i) {
    const auto &now = world.source.objects[i].vertices, &then = before.source.objects[i].vertices;
    EXPECT_TRUE(is_closed(world.source.objects[i]));
    for (std::size_t v = 0; v < then.size(); ++v) {
      EXPECT_GT(length(now[v] - then[v]), 0);
      EXPECT_LE(length(now[v] - then[v]), 1e-3 * std::numbers::sqrt3);
    }
  }
}

TEST(Perturbations, tearing_opens_every_edge) {
  for (const SourceObject& object : torn(small_world(), 1e-6, 7).source.objects) {
    EXPECT_FALSE(is_closed(object));
    EXPECT_EQ(object.vertices.size(), 3 * object.triangles.size());
  }
}

// Distances between cell and matter, divided by `scale`.
void expect_congruent(const World& world, double scale, double tolerance) {
  const World before = small_world();
  for (std::size_t i = 0; i < before.source.objects.size(); ++i)
    for (std::size_t v = 0; v < before.source.objects[i].vertices.size(); ++v)
      EXPECT_NEAR(length(world.source.objects[i].vertices[v] - world.cells[0].center()) / scale,
                  length(before.source.objects[i].vertices[v] - before.cells[0].center()),
                  tolerance);
  EXPECT_NEAR(length(world.cells[0].corner(7) - world.cells[0].corner(0)) / scale,
              length(before.cells[0].corner(7) - before.cells[0].corner(0)), tolerance);
}

TEST(Perturbations, turning_moving_and_scaling_take_the_cell_along) {
  Random random(3);
  expect_congruent(turned(small_world(), random_frame(random)), 1, 1e-12);
  expect_congruent(turned(small_world(), {Vec3{0, 1, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}}), 1, 0);
  expect_congruent(moved(small_world(), {1e6, -1e6, 1e6}), 1, 1e-8);
  expect_congruent(moved(turned(small_world(), random_frame(random)), {9, 8, 7}), 1, 1e-12);
  expect_congruent(scaled(small_world(), 1e3), 1e3, 1e-9);
}

TEST(Perturbations, a_mirrored_solid_still_looks_outwards) {
  const World world = turned(small_world(), {Vec3{-1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}});
  expect_congruent(world, 1, 0);
  const SourceObject& block = world.source.objects[0];
  double volume = 0;
  for (const auto& t : block.triangles)
    volume += dot(block.vertices[t[0]], cross(block.vertices[t[1]], block.vertices[t[2]])) / 6;
  EXPECT_DOUBLE_EQ(volume, 24);
}

TEST(Perturbations, an_origin_follows_its_object) {
  SceneSource many;
  for (int i = 0; i < 20; ++i)
    many.objects.push_back(box_object(std::to_string(i), {{1.0 * i, 0, 0}, {i + 0.5, 1, 1}}));
  const World before = world_of(many, {});
  const World shuffled = renumbered(before, 5);
  EXPECT_NE(shuffled.origin, before.origin);
  for (const World& world : {shuffled, twinned(shuffled), divided(shuffled)})
    for (std::size_t i = 0; i < world.source.objects.size(); ++i) {
      const std::string& name = world.source.objects[i].name;
      EXPECT_EQ(name.substr(0, name.find(' ')), std::to_string(world.origin[i]));
    }
}

TEST(Perturbations, divided_objects_share_their_surface_and_neither_is_closed) {
  const World before = small_world(), world = divided(small_world());
  ASSERT_EQ(world.source.objects.size(), 4u);
  for (int i = 0; i < 2; ++i) {
    const SourceObject &rest = world.source.objects[i], &part = world.source.objects[i + 2];
    EXPECT_NEAR(area(rest) + area(part), area(before.source.objects[i]), 1e-9);
    EXPECT_FALSE(is_closed(rest));
    EXPECT_FALSE(is_closed(part));
  }
}

TEST(Perturbations, only_thin_boxes_become_flat) {
  World world = small_world();
  world.source.objects.push_back(box_object("wall", {{20, 0, 0}, {20.25, 8, 3}}));
  world.origin.push_back(2);
  world = flattened(std::move(world), 0.25);
  EXPECT_EQ(world.source.objects[0].triangles.size(), 12u);
  EXPECT_EQ(world.source.objects[1].triangles.size(), 6u);
  EXPECT_EQ(world.source.objects[2].triangles.size(), 2u);
  EXPECT_EQ(box_of(world.source.objects[2]).lo.x, 20.125);
  EXPECT_EQ(box_of(world.source.objects[2]).hi.x, 20.125);
}

// How the cell and the block overlap along each axis.
Vec3 overlap(Contact contact) {
  const World world = in_contact(small_world(), contact);
  const Box cell = world.cells[0].bounds(), block = box_of(world.source.objects[0]);
  Vec3 shared;
  for (int a = 0; a < 3; ++a)
    shared[a] = std::min(cell.hi[a], block.hi[a]) - std::max(cell.lo[a], block.lo[a]);
  return shared;
}

TEST(Perturbations, a_cell_comes_to_the_nearest_block) {
  EXPECT_EQ(overlap(Contact::kFace), Vec3(0, 1, 1));
  EXPECT_EQ(overlap(Contact::kEdge), Vec3(0, 1, 0));
  EXPECT_EQ(overlap(Contact::kCorner), Vec3(0, 0, 0));
  EXPECT_EQ(overlap(Contact::kCut), Vec3(0.5, 1, 1));
  EXPECT_EQ(overlap(Contact::kInside), Vec3(1, 1, 1));
}

}  // namespace
}  // namespace pvsfarm

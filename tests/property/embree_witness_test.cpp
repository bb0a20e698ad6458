#include "tests/support/embree_witness.hpp"

#include <gtest/gtest.h>

#include <array>
#include <numeric>

#include "tests/property/random_scenes.hpp"
#include "tests/support/aimed_rays.hpp"
#include "tests/support/make_objects.hpp"

namespace pvsfarm {
namespace {

const Cell kCell = Cell::aligned({{-1, -1, -1}, {1, 1, 1}});

SourceObject wall_at(double x) {
  return polygon_object(
      "wall", std::array{Vec3{x, -20, -20}, Vec3{x, 20, -20}, Vec3{x, 20, 20}, Vec3{x, -20, 20}});
}
SourceObject thing_at(double x) { return box_object("thing", {{x, -1, -1}, {x + 1, 1, 1}}); }

WitnessReport look(const SceneSource& source, std::uint64_t rays) {
  const RayOracle oracle(source);
  EmbreeWitness witness(source, oracle);
  std::vector<std::uint32_t> all(source.objects.size());
  std::iota(all.begin(), all.end(), 0u);
  Random random(1);
  return witness.sample(kCell, {.uniform_rays = rays, .aimed_rays = rays, .targets = all}, random);
}

TEST(EmbreeWitness, sees_a_wall_and_what_is_before_it_but_nothing_behind) {
  SceneSource source;
  source.objects = {thing_at(3), wall_at(5), thing_at(7)};
  const WitnessReport report = look(source, 20000);
  EXPECT_TRUE(report.seen(0));
  EXPECT_TRUE(report.seen(1));
  EXPECT_FALSE(report.seen(2));
  EXPECT_EQ(report.rays, 40000u);
}

TEST(EmbreeWitness, looks_through_what_is_not_opaque_and_sees_that_too) {
  SceneSource source;
  source.objects = {wall_at(3), wall_at(4), wall_at(5), thing_at(7)};
  source.objects[0].occluder = false;
  source.objects[1].dynamic = true;
  const WitnessReport report = look(source, 2000);
  EXPECT_TRUE(report.seen(0));
  EXPECT_TRUE(report.seen(1));
  EXPECT_TRUE(report.seen(2));
  EXPECT_FALSE(report.seen(3));
}

TEST(EmbreeWitness, a_one_sided_wall_blocks_and_shows_only_from_its_front) {
  SceneSource source;
  source.objects = {wall_at(5), thing_at(7)};  // front towards +x, away from the cell
  source.objects[0].two_sided = false;
  WitnessReport report = look(source, 5000);
  EXPECT_FALSE(report.seen(0));
  EXPECT_TRUE(report.seen(1));
  for (auto& t : source.objects[0].triangles) std::swap(t[0], t[1]);
  report = look(source, 5000);
  EXPECT_TRUE(report.seen(0));
  EXPECT_FALSE(report.seen(1));
}

TEST(EmbreeWitness, finds_what_shows_through_a_narrow_slit) {
  SceneSource source;
  source.objects = {box_object("left", {{5, -20, -20}, {5, -0.001, 20}}),
                    box_object("right", {{5, 0.001, -20}, {5, 20, 20}}), thing_at(7)};
  EXPECT_TRUE(look(source, 20000).seen(2));
}

// Two samplers with nothing but the oracle in common agree on nearly all of what is seen.
TEST(EmbreeWitness, agrees_with_rays_in_double) {
  std::size_t by_embree = 0, by_double = 0, both = 0;
  for (Family family : {Family::kBlocks, Family::kMeshes, Family::kPlates}) {
    const RandomWorld world = random_world(family, 5);
    const RayOracle oracle(world.source);
    EmbreeWitness witness(world.source, oracle);
    Random random(1);
    std::vector<std::uint32_t> all(world.source.objects.size());
    std::iota(all.begin(), all.end(), 0u);
    const auto report = witness.sample(
        world.cells[0], {.uniform_rays = 20000, .aimed_rays = 100000, .targets = all}, random);
    const double margin = oracle.margin_for(world.cells[0].bounds());
    for (std::uint32_t o = 0; o < world.source.objects.size(); ++o) {
      if (!world.source.objects[o].two_sided) continue;  // plain rays would see their backs
      bool seen = false;
      for (int k = 0; k < 3000 && !seen; ++k)
        seen = oracle.clear_by(
            {sample_cell(world.cells[0], random), sample_surface(world.source.objects[o], random)},
            margin, o);
      by_double += seen;
      by_embree += report.seen(o);
      both += seen && report.seen(o);
    }
  }
  EXPECT_GT(by_double, 30u);
  EXPECT_GE(both * 100, by_double * 97);
  EXPECT_GE(both * 100, by_embree * 90);
}

}  // namespace
}  // namespace pvsfarm

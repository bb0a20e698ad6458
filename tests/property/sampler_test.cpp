#include "worker/visibility/sampler.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "common/scene/scene_build.hpp"
#include "coordinator/generate/generate.hpp"
#include "tests/property/random_scenes.hpp"
#include "tests/scenes/real_scenes.hpp"
#include "tests/support/make_objects.hpp"
#include "tests/support/ray_oracle.hpp"

namespace pvsfarm {
namespace {

const Cell kCell = Cell::aligned({{-1, -1, -1}, {1, 1, 1}});

SourceObject wall_at(double x) {
  return polygon_object(
      "wall", std::array{Vec3{x, -20, -20}, Vec3{x, 20, -20}, Vec3{x, 20, 20}, Vec3{x, -20, 20}});
}
SourceObject thing_at(double x) { return box_object("thing", {{x, -1, -1}, {x + 1, 1, 1}}); }

std::shared_ptr<const Scene> built(const SceneSource& source) {
  auto scene = build_scene(source);
  EXPECT_TRUE(scene.ok());
  return *scene;
}

// Positions in the source of what was seen, and the segments that saw it.
struct Seen {
  std::vector<char> object;
  std::vector<Witness> witnesses;
};

Seen look(const SceneSource& source, const Cell& cell, double near_m = 0) {
  const auto scene = built(source);
  Sampler sampler(scene);
  sampler.begin(cell, 1, near_m);
  sampler.look_around(2000);
  sampler.aim(VisibleSet::all(scene->object_count()), 20000);
  Seen seen{std::vector<char>(source.objects.size(), 0), sampler.witnesses()};
  sampler.seen().for_each([&](ObjectId id) { seen.object[scene->object(id).file_index] = 1; });
  return seen;
}

double distance_to(const Cell& cell, const Vec3& p) {
  double most = 0;
  for (int a = 0; a < 3; ++a) {
    const double t = dot(p - cell.origin, cell.axes[a]);
    most = std::max({most, cell.lo[a] - t, t - cell.hi[a]});
  }
  return most;
}

// From the nearest triangle whose plane the point lies over.
double distance_to(const SourceObject& object, const Vec3& p) {
  double least = 1e300;
  for (const auto& t : object.triangles) {
    const Vec3 a = object.vertices[t[0]], b = object.vertices[t[1]], c = object.vertices[t[2]];
    const Vec3 n = cross(b - a, c - a) / length(cross(b - a, c - a));
    const bool over = dot(cross(b - a, n), p - a) < 0 && dot(cross(c - b, n), p - b) < 0 &&
                      dot(cross(a - c, n), p - c) < 0;
    if (over) least = std::min(least, std::abs(dot(n, p - a)));
  }
  return least;
}

TEST(Sampler, sees_a_wall_and_what_is_before_it_but_nothing_behind) {
  SceneSource source;
  source.objects = {thing_at(3), wall_at(5), thing_at(7)};
  EXPECT_EQ(look(source, kCell).object, (std::vector<char>{1, 1, 0}));
}

TEST(Sampler, looks_through_what_is_not_opaque_and_sees_that_too) {
  SceneSource source;
  source.objects = {wall_at(3), wall_at(4), wall_at(5), thing_at(7)};
  source.objects[0].occluder = false;
  source.objects[1].dynamic = true;
  EXPECT_EQ(look(source, kCell).object, (std::vector<char>{1, 1, 1, 0}));
}

TEST(Sampler, a_one_sided_wall_blocks_and_shows_only_from_its_front) {
  SceneSource source;
  source.objects = {wall_at(5), thing_at(7)};  // front towards +x, away from the cell
  source.objects[0].two_sided = false;
  EXPECT_EQ(look(source, kCell).object, (std::vector<char>{0, 1}));
  for (auto& t : source.objects[0].triangles) std::swap(t[0], t[1]);
  EXPECT_EQ(look(source, kCell).object, (std::vector<char>{1, 0}));
}

TEST(Sampler, finds_what_shows_through_a_slit_of_a_millimetre) {
  SceneSource source;
  source.objects = {box_object("left", {{5, -20, -20}, {5, -0.0005, 20}}),
                    box_object("right", {{5, 0.0005, -20}, {5, 20, 20}}), thing_at(7)};
  EXPECT_EQ(look(source, kCell).object, (std::vector<char>{1, 1, 1}));
}

TEST(Sampler, matter_before_the_near_distance_proves_nothing) {
  SceneSource source;
  source.objects = {thing_at(3), box_object("behind", {{-20, -1, -1}, {-19, 1, 1}})};
  EXPECT_EQ(look(source, kCell, 6).object, (std::vector<char>{0, 1}));
}

// Part of one upright plane askew to the axes, between two of its uprights, moved back.
SourceObject askew_wall(const std::string& name, Role role, const Vec3& from, const Vec3& to,
                        double back = 0) {
  SourceObject wall = box_object(name, {{0, 0, 0}, {1, 1, 1}}, role);
  wall.vertices = {{from.x, from.y, -from.z}, from, to, {to.x, to.y, -to.z}};
  for (Vec3& v : wall.vertices) v.x += back;
  wall.triangles = {{0, 1, 2}, {0, 2, 3}};
  wall.two_sided = true;
  return wall;
}

TEST(Sampler, sees_what_coincides_with_a_blocker_but_not_a_step_behind_it) {
  const double step = std::nextafter(6.0, 7) - 6;
  for (const double back : {0.0, -0.01, step, 0.01}) {
    SceneSource source;
    source.objects = {askew_wall("blocker", Role::kOnlyOccludes, {4, -3, 8}, {7, 3, 8}),
                      askew_wall("drawn", Role::kOnlyOccluded, {5, -1, 1}, {6, 1, 0.7}, back)};
    EXPECT_EQ(look(source, kCell).object[1], back <= 0 ? 1 : 0) << back;
  }
}

TEST(Sampler, far_from_the_origin_it_sees_the_same) {
  SceneSource source;
  source.objects = {thing_at(3), wall_at(5), thing_at(7)};
  const Vec3 far{1e7, -2e7, 3e6};
  for (SourceObject& object : source.objects)
    for (Vec3& v : object.vertices) v += far;
  const Cell cell = Cell::aligned({far - Vec3{1}, far + Vec3{1}});
  EXPECT_EQ(look(source, cell).object, (std::vector<char>{1, 1, 0}));
}

TEST(Sampler, slivers_and_points_are_never_seen) {
  SceneSource source;
  source.objects = {
      polygon_object("line", std::array{Vec3{3, 0, 0}, Vec3{3, 1, 0}, Vec3{3, 2, 0}}),
      polygon_object("point", std::array{Vec3{3, 0, 0}, Vec3{3, 0, 0}, Vec3{3, 0, 0}}),
      polygon_object("sliver", std::array{Vec3{3, -9, 2}, Vec3{3, 9, 2}, Vec3{3, 0, 2 + 1e-13}})};
  EXPECT_EQ(look(source, kCell).object, (std::vector<char>{0, 0, 0}));
}

TEST(Sampler, a_cell_that_is_a_point_sees) {
  SceneSource source;
  source.objects = {thing_at(3), wall_at(5), thing_at(7)};
  EXPECT_EQ(look(source, Cell::aligned({Vec3{0}, Vec3{0}})).object, (std::vector<char>{1, 1, 0}));
}

TEST(Sampler, counts_the_triangles_of_its_best_viewpoint) {
  SceneSource source;  // two rooms of one cell: what one half sees the other does not
  source.objects = {box_object("divider", {{0, -20, -20}, {0.1, 20, 20}}), thing_at(5),
                    box_object("left", {{-6, -1, -1}, {-5, 1, 1}}),
                    box_object("left too", {{-6, 3, -1}, {-5, 5, 1}})};
  const auto scene = built(source);
  Sampler sampler(scene);
  sampler.begin(kCell, 1, 0);
  sampler.aim(VisibleSet::all(scene->object_count()), 20000);
  ASSERT_EQ(sampler.seen().count(), 4u);
  EXPECT_EQ(sampler.most_triangles_from_a_point(16), 36u);
  EXPECT_EQ(sampler.seen().count(), 4u);
}

// The judge of the tests shares nothing with the sampler.
TEST(Sampler, every_witness_is_confirmed_by_another_judge) {
  std::size_t confirmed = 0;
  for (const Family family : kFamilies) {
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      SCOPED_TRACE(std::string(to_string(family)) + " " + std::to_string(seed));
      const RandomWorld world = random_world(family, seed);
      const RayOracle oracle(world.source);
      const auto scene = built(world.source);
      Sampler sampler(scene);
      for (const Cell& cell : world.cells) {
        sampler.begin(cell, seed, 0);
        sampler.look_around(500);
        sampler.aim(VisibleSet::all(scene->object_count()), 4000);
        ASSERT_EQ(sampler.witnesses().size(), sampler.seen().count());
        for (const Witness& w : sampler.witnesses()) {
          const std::uint32_t object = scene->object(w.object).file_index;
          ASSERT_FALSE(oracle.blocker_before({w.eye, w.point}, 0.1 * sampler.margin(), object,
                                             world.source.objects[object]))
              << object;
          ASSERT_LE(distance_to(cell, w.eye), sampler.margin());
          ASSERT_LE(distance_to(world.source.objects[object], w.point), sampler.margin());
          ++confirmed;
        }
      }
    }
  }
  EXPECT_GT(confirmed, 1000u);
}

bool same(const std::vector<Witness>& a, const std::vector<Witness>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Witness& x, const Witness& y) {
    return x.object == y.object && x.eye == y.eye && x.point == y.point;
  });
}

// The witnesses of a few calls, and what they cost; with Embree in the given instruction set.
struct Trace {
  std::vector<Witness> witnesses;
  std::uint64_t rays = 0, triangles = 0;
};
Trace trace(Sampler& sampler, const Cell& cell, const VisibleSet& targets, std::uint64_t seed) {
  Trace result;
  sampler.begin(cell, seed, 0.1);
  result.rays += sampler.look_around(300).rays;
  result.rays += sampler.aim(targets, 3000).rays;
  result.triangles = sampler.most_triangles_from_a_point(2);
  result.rays += sampler.aim(targets, 1000).rays;
  result.witnesses = sampler.witnesses();
  return result;
}

// The first does without Embree.
constexpr const char* kInstructionSets[] = {"none",    "isa=sse2", "isa=sse4.2",
                                            "isa=avx", "isa=avx2", "isa=avx512"};

// Embree in any instruction set gives the witnesses that are found without it, bit by bit.
std::size_t compare_instruction_sets(const SceneSource& source, std::span<const Cell> cells) {
  const auto scene = built(source);
  const VisibleSet all = VisibleSet::all(scene->object_count());
  std::vector<std::unique_ptr<Sampler>> samplers;
  for (const char* isa : kInstructionSets)
    samplers.push_back(std::make_unique<Sampler>(scene, isa));
  samplers.push_back(std::make_unique<Sampler>(scene));
  std::size_t witnesses = 0;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const Trace first = trace(*samplers[0], cells[c], all, c);
    for (std::size_t k = 1; k < samplers.size(); ++k) {
      const Trace other = trace(*samplers[k], cells[c], all, c);
      EXPECT_TRUE(same(first.witnesses, other.witnesses)) << "cell " << c << ", set " << k;
      EXPECT_EQ(first.rays, other.rays);
      EXPECT_EQ(first.triangles, other.triangles);
    }
    witnesses += first.witnesses.size();
  }
  return witnesses;
}

TEST(Sampler, random_worlds_give_the_same_witnesses_with_every_instruction_set) {
  for (const Family family : kFamilies) {
    for (std::uint64_t seed = 101; seed <= 104; ++seed) {
      SCOPED_TRACE(std::string(to_string(family)) + " " + std::to_string(seed));
      const RandomWorld world = random_world(family, seed);
      compare_instruction_sets(world.source, world.cells);
    }
  }
}

// Slats and gaps of a few steps of a float, for the scene's centre is a thousand kilometres away:
// here Embree is often wrong.
TEST(Sampler, gaps_of_a_float_step_give_the_same_witnesses_with_every_instruction_set) {
  constexpr int kSlats = 100;
  constexpr double kFar = 2e6;
  SceneSource source;
  source.objects = {box_object("far", {Vec3{-kFar}, Vec3{1 - kFar}})};
  for (int i = 0; i < kSlats; ++i) {
    const double y = i - kSlats / 2;
    source.objects.push_back(box_object("slat", {{50, y, -60}, {50, y + 0.7, 60}}));
    source.objects.push_back(box_object("behind", {{60, y, -2}, {60.5, y + 1, 2}}));
  }
  EXPECT_GT(compare_instruction_sets(source, std::array{kCell, kCell}), 3u * kSlats);
}

TEST(Sampler, large_scenes_give_the_same_witnesses_with_every_instruction_set) {
  std::vector<NamedScene> scenes = scenes_on_disk();  // none where there is no such folder
  if (scenes.size() > 2) scenes.resize(2);
  for (const NamedScene& scene : scenes) {
    SCOPED_TRACE(scene.name);
    const auto loaded = load(scene);
    ASSERT_TRUE(loaded.ok()) << loaded.error().text;
    const std::size_t step = loaded->cells.size() / 3 + 1;
    std::vector<Cell> cells;
    for (std::size_t i = 0; i < loaded->cells.size(); i += step) cells.push_back(loaded->cells[i]);
    EXPECT_GT(compare_instruction_sets(loaded->source, cells), 0u);
  }
  CityRequest request;
  request.blocks = 8;
  const auto city = generate_city(request);
  ASSERT_TRUE(city.ok());
  const std::array cells{city->cells.front().cell, city->cells[city->cells.size() / 2].cell};
  EXPECT_GT(compare_instruction_sets(city->source, cells), 200u);
}

}  // namespace
}  // namespace pvsfarm

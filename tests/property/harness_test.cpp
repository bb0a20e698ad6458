// The harness must be able to fail: told that a visible object is hidden, it finds the lie.
#include <gtest/gtest.h>

#include <iostream>

#include "tests/property/random_scenes.hpp"
#include "tests/support/aimed_rays.hpp"

namespace pvsfarm {
namespace {

class Harness : public testing::TestWithParam<Family> {};

// Occludees of which plain sampling, other code than the search, has seen a surface point.
std::vector<std::uint32_t> seen_by_plain_sampling(const RandomWorld& world, const Cell& cell,
                                                  const RayOracle& oracle, Random& random) {
  constexpr int kRaysPerObject = 400;
  const double margin = oracle.margin_for(cell.bounds());
  std::vector<std::uint32_t> seen;
  for (std::uint32_t o = 0; o < world.source.objects.size(); ++o) {
    const SourceObject& object = world.source.objects[o];
    for (int k = 0; object.occludee && k < kRaysPerObject; ++k) {
      const Vec3 t{random.between(cell.lo.x, cell.hi.x), random.between(cell.lo.y, cell.hi.y),
                   random.between(cell.lo.z, cell.hi.z)};
      const Segment segment{cell.point(t), sample_surface(object, random)};
      if (!oracle.clear_by(segment, margin, o)) continue;
      seen.push_back(o);
      break;
    }
  }
  return seen;
}

TEST_P(Harness, finds_every_visible_object_that_is_called_hidden) {
  constexpr std::uint64_t kRaysPerObject = 2000;
  std::size_t lies = 0, found = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const RandomWorld world = random_world(GetParam(), seed);
    const RayOracle oracle(world.source);
    const AimedRays rays(world.source, oracle);
    Random random(seed);
    const Cell& cell = world.cells[seed % world.cells.size()];
    for (std::uint32_t object : seen_by_plain_sampling(world, cell, oracle, random)) {
      ++lies;
      const auto report = rays.search(cell, {&object, 1}, kRaysPerObject, random);
      found += report.violations.size();
    }
  }
  std::cout << to_string(GetParam()) << ": " << found << " of " << lies << " lies found\n";
  EXPECT_GT(lies, 40u);
  EXPECT_GE(found * 1000, lies * 998);
}

TEST_P(Harness, worlds_have_hidden_objects_to_talk_about) {
  // An object that 1000 aimed rays do not reach is hidden, as good as surely.
  std::size_t occludees = 0, unreached = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const RandomWorld world = random_world(GetParam(), seed);
    const RayOracle oracle(world.source);
    const AimedRays rays(world.source, oracle);
    Random random(seed);
    for (std::uint32_t o = 0; o < world.source.objects.size(); ++o) {
      if (!world.source.objects[o].occludee) continue;
      ++occludees;
      unreached += rays.search(world.cells[0], {&o, 1}, 1000, random).violations.empty();
    }
  }
  std::cout << to_string(GetParam()) << ": " << unreached << " of " << occludees
            << " objects hidden\n";
  EXPECT_GT(unreached * 20, occludees);
}

INSTANTIATE_TEST_SUITE_P(Families, Harness, testing::ValuesIn(kFamilies),
                         [](const auto& test) { return to_string(test.param); });

}  // namespace
}  // namespace pvsfarm

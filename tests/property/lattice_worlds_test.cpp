// Every prover alone, on thousands of worlds in which everything coincides: nothing that a ray
// reaches may be hidden. What one prover hides no other can be caught at, so each has its own. And
// what it hides depends on nothing that it evaluated before.
//
//   PVSFARM_FULL=1   a hundred times as many worlds
//   PVSFARM_SEED=S   only the world of this seed (a failure prints it)
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <iostream>

#include "tests/property/lattice_worlds.hpp"
#include "tests/support/aimed_rays.hpp"
#include "tests/support/evaluation.hpp"

namespace pvsfarm {
namespace {

constexpr std::uint64_t kWorlds = 100, kFullTimes = 100;
constexpr std::uint64_t kRays = 60;  // of either kind, for each hidden object

const Methods kProvers[] = {
    {Method::kProjection},
    {Method::kFineProjection},
    {Method::kSurfaces},
    {Method::kSlices},
    {Method::kSweep},
    {Method::kShafts},
    {Method::kImproved, Method::kProjection},
    {Method::kImproved, Method::kFineProjection},
    {Method::kImproved, Method::kSurfaces},
};

std::string names_of(Methods methods) {
  std::string names;
  for (int m = 0; m < kMethodCount; ++m)
    if (methods.has(static_cast<Method>(m)))
      names += std::string(names.empty() ? "" : " ") + to_string(static_cast<Method>(m));
  return names;
}

EvaluatorSettings random_settings(Methods methods, const LatticeWorld& world, Random& random) {
  EvaluatorSettings settings = provers_only(RasterKind::kDirect);
  settings.methods = methods;
  settings.resolution_px = 64 << random.below(3);
  settings.planes_per_face = 1 + static_cast<int>(random.below(6));
  settings.extent = random.between(0.3, 3);
  if (random.below(4) == 0)
    for (const Cell& cell : world.cells)
      settings.near_m = std::max(settings.near_m, random.unit() * length(cell.hi - cell.lo));
  return settings;
}

// From anywhere in the cell, mostly just beside one of its faces, to the object itself. What is
// nearer than the near clip is not looked at.
Segment line_from_within(const Cell& cell, const SourceObject& object, double near_m,
                         Random& random) {
  const double beside = std::pow(10.0, -random.between(0, 8));
  Vec3 share;
  for (int a = 0; a < 3; ++a) {
    const double from_face = beside * random.unit();
    const double shares[] = {random.unit(), from_face, 1 - from_face};
    share[a] = shares[random.below(3)];
  }
  Segment line{cell.point(cell.lo + (cell.hi - cell.lo) * share), sample_surface(object, random)};
  const double whole = length(line.to - line.from);
  if (near_m > 0) line.from += (line.to - line.from) * std::min(1.0, near_m * (1 + 1e-6) / whole);
  return line;
}

struct Tally {
  std::uint64_t worlds = 0, hidden = 0, rays = 0;
};

void judge_world(Methods methods, std::uint64_t seed, Tally& tally) {
  const LatticeWorld world = lattice_world(seed);
  Random random(seed ^ 0x5eed);
  const EvaluatorSettings settings = random_settings(methods, world, random);
  Evaluation evaluation(world.source, settings);
  const RayOracle oracle(world.source);
  const AimedRays aimed(world.source, oracle);
  ++tally.worlds;
  std::vector<std::vector<std::uint32_t>> hidden_from;
  for (const Cell& cell : world.cells) hidden_from.push_back(evaluation.hidden_from(cell));
  EXPECT_EQ(evaluation.hidden_from(world.cells[0]), hidden_from[0])
      << names_of(methods) << ", PVSFARM_SEED=" << seed;
  for (const Cell& cell : world.cells) {
    const auto& hidden = hidden_from[&cell - world.cells.data()];
    std::vector<Violation> violations;
    if (settings.near_m == 0) {
      const auto report = aimed.search(cell, hidden, kRays * hidden.size(), random);
      violations = report.violations;
      tally.rays += report.rays;
    }
    const double margin = oracle.margin_for(cell.bounds());
    for (const std::uint32_t object : hidden)
      for (std::uint64_t k = 0; k < kRays; ++k) {
        const Segment line =
            line_from_within(cell, world.source.objects[object], settings.near_m, random);
        ++tally.rays;
        if (oracle.blocker(line, margin, object)) continue;
        violations.push_back({object, line});
        break;
      }
    tally.hidden += hidden.size();
    for (const Violation& violation : violations)
      ADD_FAILURE() << names_of(methods) << ", PVSFARM_SEED=" << seed << ", cell "
                    << &cell - world.cells.data() << ", near " << settings.near_m << ": "
                    << to_string(violation);
  }
}

class LatticeWorlds : public testing::TestWithParam<Methods> {};

TEST_P(LatticeWorlds, nothing_that_a_ray_reaches_is_hidden) {
  const Methods methods = GetParam();
  Tally tally;
  if (const char* seed = std::getenv("PVSFARM_SEED")) {
    judge_world(methods, std::strtoull(seed, nullptr, 10), tally);
    return;
  }
  const std::uint64_t worlds = kWorlds * (std::getenv("PVSFARM_FULL") != nullptr ? kFullTimes : 1);
  for (std::uint64_t k = 0; k < worlds && !HasFailure(); ++k)
    judge_world(methods, (std::uint64_t{methods.bits()} << 32) + k, tally);
  EXPECT_GT(tally.hidden, 0u);  // or nothing was put to the test
  std::cout << names_of(methods) << ": " << tally.worlds << " worlds, " << tally.hidden
            << " objects hidden, " << tally.rays << " rays\n";
}

std::string name_of(const testing::TestParamInfo<Methods>& test) {
  std::string name = names_of(test.param);
  for (char& c : name)
    if (c == ' ' || c == '-') c = '_';
  return name;
}

INSTANTIATE_TEST_SUITE_P(Provers, LatticeWorlds, testing::ValuesIn(kProvers), name_of);

}  // namespace
}  // namespace pvsfarm

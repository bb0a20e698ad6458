// What a perturbation does to visible sets: whether they are still sound, and how far they grow.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/pvs/settings.hpp"
#include "tests/adversarial/perturbations.hpp"

namespace pvsfarm {

// The most that visible sets may grow, counted over all cells of a scene in its unperturbed
// triangles. Rounding, a loss of a seam here and there and other choices of planes are within it;
// more is a regression.
inline constexpr double kSameSets = 1;          // each visible set is the same
inline constexpr double kAnyGrowth = HUGE_VAL;  // matter changes, or what makes it a good occluder

struct Perturbation {
  std::string name;   // as charts and tests call it: "jitter"
  double amount = 0;  // 0: it has none
  std::function<World(World, std::uint64_t seed)> apply;
  double most_growth = kAnyGrowth;
};
std::string to_string(const Perturbation& perturbation);  // "jitter 1e-06"
const std::vector<Perturbation>& all_perturbations();

// What the evaluator says of a world, by cell and by object of the unperturbed world.
struct VisibleSets {
  std::vector<std::vector<char>> visible;  // if any object that comes from it is in the PVS
  std::uint64_t triangles = 0;             // of all cells, in unperturbed triangles
};

struct Attack {
  std::uint64_t rays_per_hidden_object = 0;  // in double precision, at its box
  std::uint64_t witness_rays = 0;            // a cell, with Embree; half of them uniform
  std::uint64_t seed = 1;
};
struct Judgement {
  VisibleSets sets;
  std::uint64_t seen_triangles = 0;  // by the witness rays
  std::uint64_t rays = 0;
  std::vector<std::string> violations;
};

// `unperturbed`: the world that world.origin points into.
VisibleSets evaluate(const World& world, const World& unperturbed,
                     const EvaluatorSettings& settings);
Judgement judge(const World& world, const World& unperturbed, const EvaluatorSettings& settings,
                const Attack& attack);

}  // namespace pvsfarm

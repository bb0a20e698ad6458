// The worlds that the stability suite perturbs: tiny situations by name, random worlds, and small
// generated scenes.
#pragma once

#include <string>
#include <vector>

#include "tests/adversarial/perturbations.hpp"

namespace pvsfarm {

enum class SceneKind {
  kTiny,       // a situation: what hides what is known
  kRandom,     // a random world
  kGenerated,  // a generator's scene, small
};

struct StabilityScene {
  std::string name;
  SceneKind kind = SceneKind::kTiny;
  World world;
};

struct StabilitySize {
  std::size_t cells = 6;  // at most so many a scene, spread over it; tiny ones have one
  int rooms = 3;          // rooms x rooms
};
std::vector<StabilityScene> stability_scenes(const StabilitySize& size);

}  // namespace pvsfarm

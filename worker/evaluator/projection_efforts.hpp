// How hard the provers with planes try, by a bake's settings.
#pragma once

#include "common/pvs/settings.hpp"
#include "worker/evaluator/projection_prover.hpp"

namespace pvsfarm {

// Rule S: an object's box is halved so often in a row, at first and when it is tried harder.
inline constexpr int kSplits = 3, kFineSplits = 6;

ProjectionEffort effort_of(const EvaluatorSettings& settings);
// The same with whole surfaces beside the pieces.
ProjectionEffort with_surfaces(ProjectionEffort effort);
// The same without pieces: maps for slices to be drawn on, where no others are.
ProjectionEffort bare(ProjectionEffort effort);

}  // namespace pvsfarm

// The heart of a worker: a pure function from (scene, settings, cell, parent's PVS) to a delta.
// It holds no socket, file, clock, thread or random source; equal input gives equal output on every
// x86-64 machine.
//
// It is a cascade over three sets: `seen` (a witness was found), `hidden` (a method holds a
// certificate), `open` (neither). PVS = seen + open. Provers and witnesses work on what is open,
// cheapest first, until the certified gap or the nominal time is reached, or nothing moves.
//
// Source: Durand 2000, theory 0.1, G; docs/algorithm.md.
#pragma once

#include <memory>
#include <span>

#include "common/cells/cell.hpp"
#include "common/pvs/delta.hpp"
#include "common/pvs/kernel.hpp"
#include "common/pvs/occludees.hpp"
#include "common/pvs/settings.hpp"
#include "common/pvs/visible_set.hpp"
#include "common/scene/scene.hpp"
#include "worker/evaluator/cascade.hpp"
#include "worker/evaluator/evidence.hpp"
#include "worker/visibility/sampler.hpp"

namespace pvsfarm {

// Threads: one object, one thread. OSMesa: one object a process (contexts do not scale).
class Evaluator {
 public:
  Evaluator(std::shared_ptr<const Scene> scene, const EvaluatorSettings& settings,
            CpuClock clock = nullptr);
  ~Evaluator();

  // The objects of `parent` that no point of `cell` can see, and those that some point certainly
  // sees. Objects that are no occludees are not in `parent`. `statistics.cpu_ms` is left 0: the
  // caller has the clock.
  // `key` is copied into the answer and seeds whatever is sampled.
  // `evidence`, if any, is told what settled its object, which must be in `parent`.
  CellDelta evaluate(const CellKey& key, const Cell& cell, const VisibleSet& parent,
                     Evidence* evidence = nullptr);
  // From now on `stages`, which outlives the evaluator, is told where time goes; null: nobody is.
  void profile(Stages* stages);
  // Of the last evaluation, one for each object of its seen set, perhaps more. Valid until the
  // next.
  std::span<const Witness> witnesses() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm

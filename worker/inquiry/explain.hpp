// Why an object is, or is not, in a cell's PVS: the evaluation again, with somebody watching.
//
// The answer names what really decided, for it comes from the evaluator that baked the store, run
// with the same settings against the same set: the witness's line, or each plane that hides a part
// of the object's box, with those who cover it (or, where that is no union of Projections, those
// whom lines meet there first). A certificate is then checked by other means:
// lines from all over the cell to all over the object must meet the scene's very triangles.
#pragma once

#include <memory>

#include "common/pvs/inquiry.hpp"
#include "common/pvs/settings.hpp"
#include "common/scene/scene.hpp"

namespace pvsfarm {

// Threads: one object, one thread. OSMesa: one object a process, and no Evaluator beside it.
class Explainer {
 public:
  Explainer(std::shared_ptr<const Scene> scene, const EvaluatorSettings& settings);
  ~Explainer();

  // Equal questions get equal answers on every x86-64 machine.
  // Requires: `question.object` is in `question.parent`, a set of occludees of the scene.
  ExplainFinding explain(const ExplainQuestion& question);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm

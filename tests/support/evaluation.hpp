// Runs the real evaluator on a scene given as triangles, and names what it hides by the positions
// of the objects in that source.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/cells/cell.hpp"
#include "common/pvs/settings.hpp"
#include "common/scene/scene.hpp"
#include "common/scene/scene_source.hpp"
#include "worker/evaluator/evaluator.hpp"

namespace pvsfarm {

// Every prover and no witness: what a witness settles first would shield a wrong certificate.
EvaluatorSettings provers_only(RasterKind raster);

class Evaluation {
 public:
  // Aborts if the scene cannot be built.
  Evaluation(const SceneSource& source, const EvaluatorSettings& settings);

  // The occludees that the evaluator proves hidden from `cell`, ascending.
  std::vector<std::uint32_t> hidden_from(const Cell& cell);
  bool hides(std::uint32_t object, const Cell& cell);

  const Scene& scene() const { return *scene_; }
  Evaluator& evaluator() { return evaluator_; }
  ObjectId id_of(std::uint32_t object) const { return id_of_[object]; }

 private:
  std::shared_ptr<const Scene> scene_;
  Evaluator evaluator_;
  std::vector<ObjectId> id_of_;
};

}  // namespace pvsfarm

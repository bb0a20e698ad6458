#include "worker/evaluator/evaluator.hpp"

#include "common/base/check.hpp"
#include "worker/evaluator/projection_prover.hpp"

namespace pvsfarm {

struct Evaluator::State {
  State(std::shared_ptr<const Scene> the_scene, const EvaluatorSettings& the_settings,
        CpuClock the_clock)
      : scene(std::move(the_scene)),
        settings(the_settings),
        clock(the_clock),
        ranking(*scene),
        projection(*scene, ranking,
                   {.raster = settings.raster,
                    .resolution_px = settings.resolution_px,
                    .planes_per_face = settings.planes_per_face,
                    .extent = settings.extent,
                    .near_m = settings.near_m}) {}

  std::shared_ptr<const Scene> scene;
  EvaluatorSettings settings;
  CpuClock clock;
  OccluderRanking ranking;
  ProjectionProver projection;
};

Evaluator::Evaluator(std::shared_ptr<const Scene> scene, const EvaluatorSettings& settings,
                     CpuClock clock)
    : state_(std::make_unique<State>(std::move(scene), settings, clock)) {}

Evaluator::~Evaluator() = default;

CellDelta Evaluator::evaluate(const CellKey& key, const Cell& cell, const VisibleSet& parent,
                              Evidence* evidence) {
  State& s = *state_;
  PVS_CHECK_EQ(parent.universe(), s.scene->object_count());
  PVS_CHECK(evidence == nullptr || parent.contains(evidence->object));
  CellDelta delta{
      .key = key, .hidden = parent, .seen = VisibleSet::none(parent.universe()), .statistics = {}};
  VisibleSet visible = parent, open = parent;
  if (evidence != nullptr) evidence->method = Method::kProjection;
  s.projection.run(cell, visible, open, delta.statistics, evidence);
  delta.hidden.remove_all(visible);
  return delta;
}

VisibleSet all_occludees(const Scene& scene) {
  VisibleSet set = VisibleSet::all(scene.object_count());
  for (std::uint32_t i = 0; i < scene.object_count(); ++i)
    if (!scene.object(ObjectId{i}).occludee) set.remove(ObjectId{i});
  return set;
}

}  // namespace pvsfarm

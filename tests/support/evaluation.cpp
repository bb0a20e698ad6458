#include "tests/support/evaluation.hpp"

#include <algorithm>

#include "common/base/check.hpp"
#include "common/scene/scene_build.hpp"

namespace pvsfarm {
namespace {

std::shared_ptr<const Scene> built(const SceneSource& source) {
  auto scene = build_scene(source);
  if (!scene.ok()) PVS_CHECK_EQ(scene.error().text, "");
  return std::move(scene).value();
}

}  // namespace

EvaluatorSettings provers_only(RasterKind raster) {
  EvaluatorSettings settings;
  settings.raster = raster;
  settings.methods = {Method::kProjection, Method::kFineProjection, Method::kSurfaces,
                      Method::kImproved, Method::kSlices, Method::kShafts};
  settings.max_rays = 0;
  settings.gap = 0;
  return settings;
}

Evaluation::Evaluation(const SceneSource& source, const EvaluatorSettings& settings)
    : scene_(built(source)), evaluator_(scene_, settings), id_of_(source.objects.size()) {
  for (std::uint32_t i = 0; i < scene_->object_count(); ++i)
    id_of_[scene_->object(ObjectId{i}).file_index] = ObjectId{i};
}

std::vector<std::uint32_t> Evaluation::hidden_from(const Cell& cell) {
  const CellDelta delta = evaluator_.evaluate(CellKey{}, cell, all_occludees(*scene_));
  std::vector<std::uint32_t> hidden;
  delta.hidden.for_each([&](ObjectId id) { hidden.push_back(scene_->object(id).file_index); });
  std::sort(hidden.begin(), hidden.end());
  return hidden;
}

bool Evaluation::hides(std::uint32_t object, const Cell& cell) {
  const auto hidden = hidden_from(cell);
  return std::binary_search(hidden.begin(), hidden.end(), object);
}

}  // namespace pvsfarm

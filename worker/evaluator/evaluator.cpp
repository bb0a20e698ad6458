#include "worker/evaluator/evaluator.hpp"

#include <algorithm>
#include <vector>

#include "common/base/check.hpp"
#include "worker/evaluator/occludee_hierarchy.hpp"
#include "worker/visibility/direct_raster.hpp"
#include "worker/visibility/occluder_ranking.hpp"
#include "worker/visibility/osmesa_raster.hpp"
#include "worker/visibility/plane_choice.hpp"

namespace pvsfarm {
namespace {

constexpr std::size_t kFirstOccluders = 192;  // projected before anything is tested
constexpr std::size_t kMostOccluders = 4096;  // projected in all
constexpr int kSplits = 2;                    // Rule S, on what two passes left open

}  // namespace

struct Evaluator::State {
  std::shared_ptr<const Scene> scene;
  EvaluatorSettings settings;
  std::unique_ptr<Rasteriser> rasteriser;
  // Kept from cell to cell so that nothing is allocated once warm.
  LocalOccluders occluders;
  std::vector<OcclusionMap> maps;
  CoverageList coverages;

  // Projects occluders [from, to) of the ranking on every map.
  void project_all(const CellFrame& frame, std::size_t from, std::size_t to, std::size_t map_count,
                   const VisibleSet& open, CellStatistics& statistics);
};

void Evaluator::State::project_all(const CellFrame& frame, std::size_t from, std::size_t to,
                                   std::size_t map_count, const VisibleSet& open,
                                   CellStatistics& statistics) {
  static thread_local std::array<Piece, 2> pieces;
  const bool later_pass = from > 0;
  for (std::size_t m = 0; m < map_count; ++m) {
    OcclusionMap& map = maps[m];
    coverages.clear();
    for (std::size_t i = from; i < to; ++i) {
      const LocalOccluder& occluder = occluders.list[i];
      if (later_pass) {
        // What is hidden itself hides nothing that is not hidden already.
        if (!owner_in(*scene, *occluder.source, open) ||
            test_box(map, occluder.box) == PlaneAnswer::kHidden) {
          ++statistics.occluders_skipped;
          continue;
        }
      }
      const int count = make_pieces(occluders, occluder, map.plane(), settings.near_m, pieces);
      for (int p = 0; p < count; ++p)
        statistics.projections +=
            project(pieces[p], map.plane(), frame.offset_scale(), coverages) ? 1 : 0;
    }
    rasteriser->draw(coverages, map);
    map.build_pyramids();
  }
}

Evaluator::Evaluator(std::shared_ptr<const Scene> scene, const EvaluatorSettings& settings)
    : state_(std::make_unique<State>()) {
  PVS_CHECK(settings.resolution_px >= 16 && settings.resolution_px <= kMaxResolutionPx);
  PVS_CHECK(settings.planes_per_face >= 1 && settings.planes_per_face <= kMaxMaps / 6);
  state_->scene = std::move(scene);
  state_->settings = settings;
  if (settings.raster == RasterKind::kOsmesa)
    state_->rasteriser = std::make_unique<OsmesaRaster>(settings.resolution_px);
  else
    state_->rasteriser = std::make_unique<DirectRaster>();
}

Evaluator::~Evaluator() = default;

CellDelta Evaluator::evaluate(const CellKey& key, const Cell& cell, const VisibleSet& parent) {
  State& s = *state_;
  const Scene& scene = *s.scene;
  CellDelta delta{.key = key, .hidden = parent, .statistics = {}};
  VisibleSet open = parent;
  PVS_CHECK_EQ(parent.universe(), scene.object_count());
  const CellFrame frame(cell);

  // 1. Occluders: legal for this cell, largest first. With the eyes above the lowest occludee,
  //    solids that stand on that level reach down without limit (theory 0.3).
  const bool above_ground = cell.bounds().lo.z >= scene.ground();
  const double reach = length(scene.bounds().size()) + length(frame.half()) +
                       length(scene.bounds().center() - cell.center());
  const double pixel = 2 * s.settings.extent / s.settings.resolution_px;
  rank_occluders(scene, frame, parent,
                 {.near_m = s.settings.near_m,
                  .ground_depth = above_ground ? 4 * reach : 0,
                  .least_solid_angle = 0.5 * pixel * pixel},
                 s.occluders);
  delta.statistics.occluder_candidates = static_cast<std::uint32_t>(s.occluders.list.size());

  // 2. Planes, and an empty map for each.
  const auto planes = choose_planes(frame, s.occluders,
                                    {.planes_per_face = s.settings.planes_per_face,
                                     .extent = s.settings.extent,
                                     .resolution_px = s.settings.resolution_px,
                                     .occludees = frame.local_around_world(scene.bvh()[0].box)});
  if (s.maps.size() < planes.size()) s.maps.resize(planes.size());
  for (std::size_t m = 0; m < planes.size(); ++m) s.maps[m].reset(planes[m]);
  delta.statistics.planes = static_cast<std::uint32_t>(planes.size());

  // 3. The largest occluders, then all objects; then the occluders that are still open, then
  //    the objects that are, this time by parts.
  const std::size_t all = std::min(s.occluders.list.size(), kMostOccluders);
  const std::size_t first = std::min(all, kFirstOccluders);
  HierarchyTest test{scene, frame, std::span(s.maps).first(planes.size())};
  s.project_all(frame, 0, first, planes.size(), open, delta.statistics);
  test.run(open);
  s.project_all(frame, first, all, planes.size(), open, delta.statistics);
  test.splits = kSplits;
  test.run(open);
  delta.statistics.box_tests = test.box_tests;

  delta.hidden.remove_all(open);
  return delta;
}

VisibleSet all_occludees(const Scene& scene) {
  VisibleSet set = VisibleSet::all(scene.object_count());
  for (std::uint32_t i = 0; i < scene.object_count(); ++i)
    if (!scene.object(ObjectId{i}).occludee) set.remove(ObjectId{i});
  return set;
}

}  // namespace pvsfarm

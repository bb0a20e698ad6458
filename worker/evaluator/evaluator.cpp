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

constexpr double kLeastPixels = 2;            // an occluder's solid angle, in pixels
constexpr std::size_t kFirstOccluders = 320;  // projected before anything is tested
constexpr std::size_t kMostOccluders = 4096;  // projected in all
constexpr int kSplits = 3;                    // Rule S, on what two passes left open

}  // namespace

struct Evaluator::State {
  State(std::shared_ptr<const Scene> the_scene, const EvaluatorSettings& the_settings)
      : scene(std::move(the_scene)), settings(the_settings), ranking(*scene) {}

  std::shared_ptr<const Scene> scene;
  EvaluatorSettings settings;
  OccluderRanking ranking;
  std::unique_ptr<Rasteriser> rasteriser;
  // Kept from cell to cell so that nothing is allocated once warm.
  std::vector<RankedOccluder> ranked;
  LocalOccluders occluders;
  std::vector<OcclusionMap> maps;
  CoverageList coverages;

  // Projects occluders [from, end) of the local list on the first `map_count` maps.
  void project_from(const CellFrame& frame, std::size_t from, std::size_t map_count,
                    CellStatistics& statistics);
};

void Evaluator::State::project_from(const CellFrame& frame, std::size_t from, std::size_t map_count,
                                    CellStatistics& statistics) {
  std::array<Piece, 2> pieces;
  for (std::size_t m = 0; m < map_count; ++m) {
    OcclusionMap& map = maps[m];
    coverages.clear();
    for (std::size_t i = from; i < occluders.list.size(); ++i) {
      const LocalOccluder& occluder = occluders.list[i];
      const int count = make_pieces(occluders, occluder, map.plane(), settings.near_m, pieces);
      for (int p = 0; p < count; ++p)
        statistics.projections +=
            project(pieces[p], map.plane(), frame.offset_scale(), coverages) ? 1 : 0;
    }
    if (coverages.coverages.empty() && from > 0) continue;
    rasteriser->draw(coverages, map);
    map.build_pyramids();
  }
}

Evaluator::Evaluator(std::shared_ptr<const Scene> scene, const EvaluatorSettings& settings)
    : state_(std::make_unique<State>(std::move(scene), settings)) {
  PVS_CHECK(settings.resolution_px >= 16 && settings.resolution_px <= kMaxResolutionPx);
  PVS_CHECK(settings.planes_per_face >= 1 && settings.planes_per_face <= kMaxMaps / 6);
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

  // 1. The largest occluders that are legal for this cell. With the eyes above the lowest occludee,
  //    solids that stand on that level reach down without limit (theory 0.3).
  const double reach = length(scene.bounds().size()) + length(frame.half()) +
                       length(scene.bounds().center() - cell.center());
  const double ground_depth = cell.bounds().lo.z >= scene.ground() ? 4 * reach : 0;
  const double pixel = 2 * s.settings.extent / s.settings.resolution_px;
  s.ranking.rank(frame, parent, kLeastPixels * pixel * pixel, kFirstOccluders, s.ranked);
  delta.statistics.occluder_candidates = static_cast<std::uint32_t>(s.ranked.size());
  s.occluders.list.clear();
  s.occluders.points.clear();
  const auto add = [&](const RankedOccluder& ranked) {
    const Occluder& occluder = scene.occluders()[ranked.index];
    if (legal_for_cell(scene, occluder, frame, s.settings.near_m))
      add_local(scene, occluder, frame, ground_depth, ranked.solid_angle, s.occluders);
  };
  const std::size_t first = std::min(s.ranked.size(), kFirstOccluders);
  for (std::size_t i = 0; i < first; ++i) add(s.ranked[i]);

  // 2. Planes, and an empty map for each.
  const auto planes = choose_planes(frame, s.occluders,
                                    {.planes_per_face = s.settings.planes_per_face,
                                     .extent = s.settings.extent,
                                     .resolution_px = s.settings.resolution_px,
                                     .occludees = extent_of(scene, frame, open)});
  if (s.maps.size() < planes.size()) s.maps.resize(planes.size());
  for (std::size_t m = 0; m < planes.size(); ++m) s.maps[m].reset(planes[m]);
  delta.statistics.planes = static_cast<std::uint32_t>(planes.size());

  // 3. The largest occluders against all objects.
  HierarchyTest test(scene, frame, std::span(s.maps).first(planes.size()));
  s.project_from(frame, 0, planes.size(), delta.statistics);
  test.run(open, 0);

  // 4. The occluders that are not hidden themselves against what is left, this time by parts.
  const std::size_t drawn = s.occluders.list.size();
  for (std::size_t i = first; i < s.ranked.size() && s.occluders.list.size() < kMostOccluders; ++i)
    if (owner_in(scene, scene.occluders()[s.ranked[i].index], open))
      add(s.ranked[i]);
    else
      ++delta.statistics.occluders_skipped;
  s.project_from(frame, drawn, planes.size(), delta.statistics);
  test.run(open, kSplits);
  delta.statistics.box_tests = test.box_tests();

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

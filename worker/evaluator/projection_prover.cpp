#include "worker/evaluator/projection_prover.hpp"

#include <algorithm>

#include "common/base/check.hpp"
#include "worker/visibility/direct_raster.hpp"
#include "worker/visibility/osmesa_raster.hpp"
#include "worker/visibility/plane_choice.hpp"

namespace pvsfarm {
namespace {

constexpr double kLeastPixels = 2;            // an occluder's solid angle, in pixels
constexpr std::size_t kFirstOccluders = 320;  // projected before anything is tested
constexpr std::size_t kMostOccluders = 4096;  // projected in all

}  // namespace

ProjectionProver::ProjectionProver(const Scene& scene, const OccluderRanking& ranking,
                                   const ProjectionEffort& effort)
    : scene_(scene), ranking_(ranking), effort_(effort), chain_builder_(scene) {
  PVS_CHECK(effort.resolution_px >= 16 && effort.resolution_px <= kMaxResolutionPx);
  PVS_CHECK(effort.planes_per_face >= 1 && effort.planes_per_face <= kMaxMaps / 6);
  if (effort.raster == RasterKind::kOsmesa)
    rasteriser_ = std::make_unique<OsmesaRaster>(effort.resolution_px);
  else
    rasteriser_ = std::make_unique<DirectRaster>();
}

// Projects occluders [from, end) of the local list on all maps.
void ProjectionProver::project_from(const CellFrame& frame, std::size_t from,
                                    CellStatistics& statistics) {
  std::array<Piece, 2> pieces;
  for (std::size_t m = 0; m < map_count_; ++m) {
    OcclusionMap& map = maps_[m];
    coverages_.clear();
    const OcclusionMap* const drawn = from > 0 ? &map : nullptr;
    if (!effort_.pieces) {
      map.build_pyramids();
      continue;
    }
    for (const std::uint32_t i : screen_.pass(map.plane(), effort_.near_m, from)) {
      const LocalOccluder& occluder = occluders_.list[i];
      const int count = make_pieces(occluders_, occluder, map.plane(), effort_.near_m, pieces);
      for (int p = 0; p < count; ++p)
        statistics.projections +=
            project(pieces[p], map.plane(), frame.offset_scale(), coverages_, drawn) ? 1 : 0;
    }
    if (coverages_.coverages.empty() && from > 0) continue;
    rasteriser_->draw(coverages_, map);
    map.build_pyramids();
  }
}

// Surfaces need no ranking: what is not met in a square of a map costs nothing there.
void ProjectionProver::draw_surfaces(const Cell& cell, const CellFrame& frame,
                                     const VisibleSet& open, CellStatistics& statistics) {
  chain_builder_.build(cell, frame, {.near_m = effort_.near_m}, chain_);
  if (chain_.triangles.empty()) return;
  for (std::size_t m = 0; m < map_count_; ++m) {
    TileMask wanted;
    open.for_each([&](ObjectId id) {
      add_wanted(maps_[m], frame.local_around_world(scene_.object(id).box), wanted);
    });
    statistics.projections += cover_.draw(chain_, frame, wanted, maps_[m]);
    maps_[m].build_pyramids();
  }
}

// Adds the ranked occluders [from, end) that are legal for the cell and, if not among the first,
// not hidden themselves.
void ProjectionProver::add_occluders(const CellFrame& frame, double ground_depth,
                                     const VisibleSet& visible, std::size_t from, std::size_t end,
                                     CellStatistics& statistics) {
  for (std::size_t i = from; i < end && occluders_.list.size() < kMostOccluders; ++i) {
    if (from > 0 && !ranking_.owned(ranked_[i], visible)) {
      ++statistics.occluders_skipped;
      continue;
    }
    const Occluder& occluder = scene_.occluders()[ranked_[i].index];
    if (legal_for_cell(scene_, occluder, frame, effort_.near_m)) {
      add_local(scene_, occluder, frame, ground_depth, ranked_[i].solid_angle, occluders_);
      screen_.add(occluders_.list.back().box);
    }
  }
}

void ProjectionProver::begin_maps(std::span<const ProjectionPlane> planes,
                                  CellStatistics& statistics) {
  map_count_ = planes.size();
  if (maps_.size() < map_count_) maps_.resize(map_count_);
  for (std::size_t m = 0; m < map_count_; ++m) maps_[m].reset(planes[m]);
  statistics.planes += static_cast<std::uint32_t>(map_count_);
}

// With the eyes above the lowest occludee, solids that stand on that level reach down without limit
// (theory 0.3): by this much, or not at all for 0.
double ProjectionProver::ground_depth(const CellFrame& frame, const Cell& cell) const {
  const double reach = length(scene_.bounds().size()) + length(frame.half()) +
                       length(scene_.bounds().center() - cell.center());
  return cell.bounds().lo.z >= scene_.ground() ? 4 * reach : 0;
}

void ProjectionProver::rank(const CellFrame& frame, const VisibleSet& visible,
                            CellStatistics& statistics) {
  const double pixel = 2 * effort_.extent / effort_.resolution_px;
  ranking_.rank(frame, visible, kLeastPixels * pixel * pixel, kFirstOccluders, ranked_);
  statistics.occluder_candidates += static_cast<std::uint32_t>(ranked_.size());
  occluders_.list.clear();
  occluders_.points.clear();
  screen_.clear();
}

void ProjectionProver::run(const Cell& cell, VisibleSet& visible, VisibleSet& open,
                           CellStatistics& statistics, Evidence* evidence) {
  const CellFrame frame(cell);

  // 1. The largest occluders that are legal for this cell.
  const double depth = ground_depth(frame, cell);
  rank(frame, visible, statistics);
  const std::size_t first = std::min(ranked_.size(), kFirstOccluders);
  add_occluders(frame, depth, visible, 0, first, statistics);

  // 2. Planes, and an empty map for each.
  const auto planes = choose_planes(frame, occluders_,
                                    {.planes_per_face = effort_.planes_per_face,
                                     .extent = effort_.extent,
                                     .resolution_px = effort_.resolution_px,
                                     .occludees = extent_of(scene_, frame, open)});
  begin_maps(planes, statistics);

  // 3. The largest occluders against all objects.
  VisibleSet hidden = open;
  HierarchyTest test(scene_, frame, maps());
  test.watch(evidence);
  project_from(frame, 0, statistics);
  test.run(open, 0);
  note(hidden, evidence);
  hidden.remove_all(open);
  visible.remove_all(hidden);

  // 4. The occluders that are not hidden themselves against what is left, this time by parts.
  hidden = open;
  const std::size_t drawn = occluders_.list.size();
  add_occluders(frame, depth, visible, first, ranked_.size(), statistics);
  project_from(frame, drawn, statistics);
  test.run(open, effort_.splits);
  if (effort_.surfaces) {
    draw_surfaces(cell, frame, open, statistics);
    test.run(open, effort_.splits);
  }
  note(hidden, evidence);
  statistics.box_tests += test.box_tests();
  hidden.remove_all(open);
  visible.remove_all(hidden);
}

void ProjectionProver::run_aimed(const Cell& cell, std::span<const ProjectionPlane> before,
                                 VisibleSet& visible, VisibleSet& open, CellStatistics& statistics,
                                 Evidence* evidence) {
  const CellFrame frame(cell);
  const double depth = ground_depth(frame, cell);
  rank(frame, visible, statistics);
  const std::size_t first = std::min(ranked_.size(), kFirstOccluders);
  add_occluders(frame, depth, visible, 0, first, statistics);
  add_occluders(frame, depth, visible, first, ranked_.size(), statistics);
  const auto planes = aim_planes(scene_, frame, occluders_, open,
                                 {.planes = std::min<std::size_t>(effort_.aimed_planes, kMaxMaps),
                                  .extent = effort_.extent,
                                  .resolution_px = effort_.resolution_px,
                                  .before = before});
  begin_maps(planes, statistics);
  if (planes.empty()) return;
  VisibleSet hidden = open;
  HierarchyTest test(scene_, frame, maps());
  test.watch(evidence);
  project_from(frame, 0, statistics);
  test.run(open, effort_.splits);
  note(hidden, evidence);
  statistics.box_tests += test.box_tests();
  hidden.remove_all(open);
  visible.remove_all(hidden);
}

// What the watched object was tested on, if it is in `tested`.
void ProjectionProver::note(const VisibleSet& tested, Evidence* evidence) const {
  if (evidence == nullptr || !tested.contains(evidence->object)) return;
  evidence->planes.clear();
  for (const OcclusionMap& map : maps()) evidence->planes.push_back(map.plane());
  evidence->occluders = occluders_;
}

}  // namespace pvsfarm

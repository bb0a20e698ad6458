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
constexpr std::size_t kBatch = 32;            // projected before any of them is drawn

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

void ProjectionProver::find_wanted(const CellFrame& frame, const VisibleSet& open) {
  StageScope stage(stages_, Stage::kWanted);
  wanted_.find(scene_, frame, open, planes_);
  stage.did(open.count() * map_count_);
}

// Projects occluders [from, end) of the local list on all maps, which are emptied first if these
// are the first of all. A map is done with before the next: it stays in the cache.
void ProjectionProver::project_from(const CellFrame& frame, std::size_t from,
                                    const WantedTiles* wanted, CellStatistics& statistics) {
  for (std::size_t m = 0; m < map_count_; ++m) {
    OcclusionMap& map = maps_[m];
    const std::size_t side = planes_[m].resolution_px;
    if (from == 0) {
      StageScope stage(stages_, Stage::kReset);
      map.reset(planes_[m]);
      stage.did(1, side * side * sizeof(float));
    }
    if (wanted != nullptr) wanted->restrict(m, map);
    if (!draw_from(frame, from, map, statistics) && from > 0 && wanted == nullptr) continue;
    StageScope stage(stages_, Stage::kPyramids);
    map.build_pyramids();
    stage.did(1, 2 * side * side * sizeof(float));
  }
}

// A batch at a time, so that what the largest cover is not drawn again. Returns whether anything
// was drawn.
bool ProjectionProver::draw_from(const CellFrame& frame, std::size_t from, OcclusionMap& map,
                                 CellStatistics& statistics) {
  if (!effort_.pieces) return false;
  StageScope screen(stages_, Stage::kScreen);
  const std::span<const std::uint32_t> passed = screen_.pass(map.plane(), effort_.near_m, from);
  screen.did(screen_.size() - from);
  const std::size_t batch = effort_.raster == RasterKind::kDirect ? kBatch : passed.size();
  bool drawn = false;
  for (std::size_t first = 0; first < passed.size(); first += batch) {
    coverages_.clear();
    {
      StageScope stage(stages_, Stage::kProject);
      std::array<Piece, 2> pieces;
      for (const std::uint32_t i : passed.subspan(first, std::min(batch, passed.size() - first))) {
        const int count =
            make_pieces(occluders_, occluders_.list[i], map.plane(), effort_.near_m, pieces);
        for (int p = 0; p < count; ++p)
          project(pieces[p], map.plane(), frame.offset_scale(), coverages_, &map);
      }
      stage.did(coverages_.coverages.size());
    }
    if (coverages_.coverages.empty()) continue;
    StageScope stage(stages_, Stage::kDraw);
    const std::uint64_t before = rasteriser_->rows_written();
    rasteriser_->draw(coverages_, map);
    const std::uint64_t rows = rasteriser_->rows_written() - before;
    stage.did(rows, 2 * rows * kTilePx * sizeof(float));
    statistics.projections += static_cast<std::uint32_t>(coverages_.coverages.size());
    drawn = true;
  }
  return drawn;
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

// The occluders of the local list that are hidden by now hide nothing that others do not.
void ProjectionProver::drop_hidden(const VisibleSet& visible, CellStatistics& statistics) {
  StageScope stage(stages_, Stage::kOccluders);
  const std::size_t gone = std::erase_if(occluders_.list, [&](const LocalOccluder& occluder) {
    return !owner_in(scene_, *occluder.source, visible);
  });
  if (gone == 0) return;
  statistics.occluders_skipped += static_cast<std::uint32_t>(gone);
  screen_.clear();
  for (const LocalOccluder& occluder : occluders_.list) screen_.add(occluder.box);
}

// Takes a map for each; it is emptied when it is drawn, so that it stays in the cache meanwhile.
void ProjectionProver::begin_maps(std::vector<ProjectionPlane> planes, CellStatistics& statistics) {
  planes_ = std::move(planes);
  tried_.insert(tried_.end(), planes_.begin(), planes_.end());
  map_count_ = planes_.size();
  if (maps_.size() < map_count_) maps_.resize(map_count_);
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
  StageScope stage(stages_, Stage::kOccluders);
  const double pixel = 2 * effort_.extent / effort_.resolution_px;
  ranking_.rank(frame, visible, kLeastPixels * pixel * pixel, ranked_);
  stage.did(scene_.occluders().size(), ranking_.bytes());
  statistics.occluder_candidates += static_cast<std::uint32_t>(ranked_.size());
  occluders_.list.clear();
  occluders_.points.clear();
  screen_.clear();
  tried_.clear();
}

void ProjectionProver::test(HierarchyTest& test, VisibleSet& open, int splits) const {
  StageScope stage(stages_, Stage::kTest);
  const std::uint32_t before = test.box_tests();
  test.run(open, splits);
  stage.did(test.box_tests() - before);
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
  {
    StageScope stage(stages_, Stage::kPlanes);
    begin_maps(choose_planes(frame, occluders_,
                             {.planes_per_face = effort_.planes_per_face,
                              .extent = effort_.extent,
                              .resolution_px = effort_.resolution_px,
                              .occludees = extent_of(scene_, frame, open)}),
               statistics);
    stage.did(map_count_);
  }

  // 3. The largest occluders against all objects.
  VisibleSet hidden = open;
  HierarchyTest test(scene_, frame, maps());
  test.watch(evidence);
  project_from(frame, 0, nullptr, statistics);
  this->test(test, open, 0);
  note(hidden, evidence);
  hidden.remove_all(open);
  visible.remove_all(hidden);

  // 4. The occluders that are not hidden themselves against what is left, this time by parts.
  hidden = open;
  const std::size_t drawn = occluders_.list.size();
  add_occluders(frame, depth, visible, first, ranked_.size(), statistics);
  find_wanted(frame, open);
  project_from(frame, drawn, &wanted_, statistics);
  this->test(test, open, effort_.splits);
  if (effort_.surfaces) {
    draw_surfaces(cell, frame, open, statistics);
    this->test(test, open, effort_.splits);
  }
  note(hidden, evidence);
  statistics.box_tests += test.box_tests();
  hidden.remove_all(open);
  visible.remove_all(hidden);
}

void ProjectionProver::refine(const Cell& cell, VisibleSet& visible, VisibleSet& open,
                              CellStatistics& statistics, Evidence* evidence) {
  const CellFrame frame(cell);
  drop_hidden(visible, statistics);
  {
    StageScope stage(stages_, Stage::kPlanes);
    begin_maps(aim_planes(scene_, frame, occluders_, open,
                          {.planes = std::min<std::size_t>(effort_.aimed_planes, kMaxMaps),
                           .extent = effort_.extent,
                           .resolution_px = effort_.resolution_px,
                           .before = tried_}),
               statistics);
    stage.did(map_count_);
  }
  if (planes_.empty()) return;
  VisibleSet hidden = open;
  HierarchyTest test(scene_, frame, maps());
  test.watch(evidence);
  find_wanted(frame, open);
  project_from(frame, 0, &wanted_, statistics);
  this->test(test, open, effort_.refined_splits);
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

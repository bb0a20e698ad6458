#include "worker/evaluator/projection_prover.hpp"

#include <algorithm>

#include "common/base/check.hpp"
#include "worker/evaluator/maps_used.hpp"
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
                                   const ProjectionEffort& effort, CpuClock clock)
    : scene_(scene), ranking_(ranking), effort_(effort), clock_(clock), chain_builder_(scene) {
  PVS_CHECK(effort.resolution_px >= 16 && effort.resolution_px <= kMaxResolutionPx);
  PVS_CHECK(effort.first_resolution_px >= 16 && effort.first_resolution_px <= kMaxResolutionPx);
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
    OcclusionMap& map = maps_of_[aimed_][m];
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
  const auto passed = screen_.pass(map.plane(), effort_.near_m, from);
  screen.did(screen_.size() - from);
  const std::size_t batch = effort_.raster == RasterKind::kDirect ? kBatch : passed.size();
  bool drawn = false;
  for (std::size_t first = 0; first < passed.size(); first += batch) {
    coverages_.clear();
    {
      StageScope stage(stages_, Stage::kProject);
      std::array<Piece, 2> pieces;
      for (const OccluderScreen::Passed& one :
           passed.subspan(first, std::min(batch, passed.size() - first))) {
        if (map.tiles_need_nothing(one.pixels, one.depth)) continue;
        const LocalOccluder& occluder = occluders_.list[one.index];
        const int count = make_pieces(occluders_, occluder, map.plane(), effort_.near_m, pieces);
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
      add_wanted(maps_of_[aimed_][m], frame.local_around_world(scene_.object(id).box), wanted);
    });
    statistics.projections += cover_.draw(chain_, frame, wanted, maps_of_[aimed_][m]);
    maps_of_[aimed_][m].build_pyramids();
  }
}

// Adds the ranked occluders [from, end) that are legal for the cell.
void ProjectionProver::add_occluders(const CellFrame& frame, std::size_t from, std::size_t end) {
  for (std::size_t i = from; i < end && occluders_.list.size() < kMostOccluders; ++i) {
    const Occluder& occluder = scene_.occluders()[ranked_[i].index];
    if (legal_for_cell(scene_, occluder, frame, effort_.near_m)) {
      add_local(scene_, occluder, frame, ground_depth_, ranked_[i].solid_angle, occluders_);
      screen_.add(occluders_.list.back().box);
    }
  }
}

// Of the ranked occluders after the first, which are hidden by now for the most part.
void ProjectionProver::keep_visible(const VisibleSet& visible, CellStatistics& statistics) {
  StageScope stage(stages_, Stage::kOccluders);
  if (ranked_.size() <= kFirstOccluders) return;
  const auto rest = ranked_.begin() + kFirstOccluders;
  const auto gone = std::remove_if(rest, ranked_.end(), [&](const RankedOccluder& ranked) {
    return !ranking_.owned(ranked, visible);
  });
  statistics.occluders_skipped += static_cast<std::uint32_t>(ranked_.end() - gone);
  ranked_.erase(gone, ranked_.end());
  sort_ranked(std::span(ranked_).subspan(kFirstOccluders));
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
  // Maps of one size are emptied where they were drawn on alone: each size keeps its own.
  aimed_ = !planes.empty() && planes[0].resolution_px == effort_.resolution_px ? 1 : 0;
  planes_ = std::move(planes);
  tried_.insert(tried_.end(), planes_.begin(), planes_.end());
  map_count_ = planes_.size();
  if (maps_of_[aimed_].size() < map_count_) maps_of_[aimed_].resize(map_count_);
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
  ranking_.rank(frame, visible, kLeastPixels * pixel * pixel, kFirstOccluders, ranked_);
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

HierarchyTest ProjectionProver::test_on(const CellFrame& frame, BoxRule rule,
                                        Evidence* evidence) const {
  HierarchyTest test(scene_, frame, maps(), rule);
  test.watch(evidence);
  test.time_improved(clock_);
  return test;
}

// `hidden`: what was open before the test.
void ProjectionProver::book(const HierarchyTest& test, VisibleSet hidden, const VisibleSet& open,
                            VisibleSet& visible, CellStatistics& statistics) {
  statistics.box_tests += test.box_tests();
  const auto improved = test.improved_objects();
  improved_objects_.assign(improved.begin(), improved.end());
  improved_tests_ = test.improved_tests();
  improved_ms_ = test.improved_ms();
  hidden.remove_all(open);
  visible.remove_all(hidden);
}

MapsUsed ProjectionProver::maps_used() const {
  MapsUsed used;
  for (const ProjectionPlane& plane : planes_) add_plane(plane, used);
  if (effort_.pieces) used.occluders = static_cast<std::uint32_t>(occluders_.list.size());
  return used;
}

void ProjectionProver::run(const Cell& cell, VisibleSet& visible, VisibleSet& open,
                           CellStatistics& statistics, Evidence* evidence) {
  const CellFrame frame(cell);

  // 1. The largest occluders that are legal for this cell.
  ground_depth_ = ground_depth(frame, cell);
  rank(frame, visible, statistics);
  add_occluders(frame, 0, std::min(ranked_.size(), kFirstOccluders));

  // 2. Planes, and an empty map for each.
  {
    StageScope stage(stages_, Stage::kPlanes);
    begin_maps(choose_planes(frame, occluders_,
                             {.planes_per_face = effort_.planes_per_face,
                              .extent = effort_.extent,
                              .resolution_px = effort_.first_resolution_px,
                              .occludees = extent_of(scene_, frame, open)}),
               statistics);
    stage.did(map_count_);
  }

  // 3. These occluders against all objects.
  const VisibleSet before = open;
  HierarchyTest test = test_on(frame, BoxRule::kPlain, evidence);
  project_from(frame, 0, nullptr, statistics);
  this->test(test, open, 0);
  note(before, evidence);
  book(test, before, open, visible, statistics);
}

void ProjectionProver::finish(const Cell& cell, VisibleSet& visible, VisibleSet& open,
                              CellStatistics& statistics, Evidence* evidence) {
  const CellFrame frame(cell);
  const VisibleSet before = open;
  const std::size_t drawn = occluders_.list.size();
  keep_visible(visible, statistics);
  add_occluders(frame, kFirstOccluders, ranked_.size());
  find_wanted(frame, open);
  project_from(frame, drawn, &wanted_, statistics);
  HierarchyTest test = test_on(frame, by_parts(), evidence);
  this->test(test, open, effort_.splits);
  if (effort_.surfaces) {
    draw_surfaces(cell, frame, open, statistics);
    this->test(test, open, effort_.splits);
  }
  note(before, evidence);
  book(test, before, open, visible, statistics);
}

void ProjectionProver::refine(const Cell& cell, VisibleSet& visible, VisibleSet& open,
                              CellStatistics& statistics, Evidence* evidence) {
  const CellFrame frame(cell);
  improved_objects_.clear();
  improved_tests_ = 0;
  improved_ms_ = 0;
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
  const VisibleSet before = open;
  HierarchyTest test = test_on(frame, by_parts(), evidence);
  find_wanted(frame, open);
  project_from(frame, 0, &wanted_, statistics);
  this->test(test, open, effort_.refined_splits);
  note(before, evidence);
  book(test, before, open, visible, statistics);
}

// What the watched object was tested on, if it is in `tested`.
void ProjectionProver::note(const VisibleSet& tested, Evidence* evidence) const {
  if (evidence == nullptr || !tested.contains(evidence->object)) return;
  evidence->planes.clear();
  for (const OcclusionMap& map : maps()) evidence->planes.push_back(map.plane());
  evidence->occluders = occluders_;
}

}  // namespace pvsfarm

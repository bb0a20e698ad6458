#include "worker/evaluator/sweep_prover.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "common/base/check.hpp"
#include "worker/evaluator/maps_used.hpp"
#include "worker/visibility/occludee_test.hpp"

namespace pvsfarm {
namespace {

// A step, as a part of the distance. A smaller one loses more to pixels than it gains by having
// occluders near a plane (theory B.2): its kernel should be many pixels wide. In a forest of 7,750
// trees steps of 0.1 from a distance of 3 on hide another 0.4 % and take half as long again.
constexpr double kStep = 0.15;
constexpr double kFirstDistance = 5;  // of the cell's half width
// A face is given up where planes have settled too little since the last that settled enough.
constexpr int kPlanesATest = 3;
constexpr double kGiveUp = 1.4;       // of that one's distance
constexpr double kLeastYield = 0.01;  // of what is open

// Depth beyond the face of a box of the local frame.
struct DepthRange {
  double lo, hi;
};
DepthRange depths(const CellFrame& frame, Face face, const Box& box) {
  const double a = face.sign * box.lo[face.axis], b = face.sign * box.hi[face.axis];
  const double half = frame.half()[face.axis];
  return {std::min(a, b) - half, std::max(a, b) - half};
}

// Memory that is wanted soon: scenes are larger than caches.
void prefetch(const void* from, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes + 63; i += 64)
    __builtin_prefetch(static_cast<const char*>(from) + std::min(i, bytes - 1));
}

// Tests boxes of occludees against the maps of all faces.
class SweepTest {
 public:
  struct Maps {
    Face face;
    std::span<const CoverageBits> maps;
  };
  // Notes in `evidence`, if any, the parts of its object that are hidden, and on which planes.
  SweepTest(const Scene& scene, const CellFrame& frame, std::span<const Maps> faces,
            Evidence* evidence)
      : scene_(scene), frame_(frame), faces_(faces), watched_(evidence) {}

  void run(VisibleSet& open, int splits) {
    splits_ = splits;
    visit(0, open);
  }
  std::uint32_t box_tests() const { return box_tests_; }

 private:
  // Rule P for a map of bits: the box is beyond the bound, and its whole Projection covered.
  bool hidden(const Box& local) {
    const double scale = length(frame_.half()) + length(local.lo) + length(local.hi);
    for (const Maps& face : faces_) {
      const double nearest = depths(frame_, face.face, local).lo - 0x1p-46 * scale;
      const auto beyond = std::partition_point(
          face.maps.begin(), face.maps.end(),
          [&](const CoverageBits& map) { return map.where().bound < nearest; });
      // The last plane before the box has seen the most occluders; nearer ones see more of the
      // box's upper and lower ends covered.
      const auto count = static_cast<std::size_t>(beyond - face.maps.begin());
      for (std::size_t back = 1; back <= count; back = back < 3 ? back + 1 : 2 * back) {
        ++box_tests_;
        const CoverageBits& map = face.maps[count - back];
        const ProjectionPlane& plane = map.where().plane;
        const Box box = plane.plane_from_local(local);
        hidden_by_ = &plane;
        if (map.covered(occludee_rect(plane, box))) return true;
      }
    }
    return false;
  }

  bool hidden_by_parts(const Box& local, int splits_left) {
    if (hidden(local)) {
      if (noting_) found_.emplace_back(local, *hidden_by_);
      return true;
    }
    if (splits_left == 0) return false;
    int axis = 0;
    const Vec3 size = local.size();
    for (int a = 1; a < 3; ++a)
      if (size[a] > size[axis]) axis = a;
    Box low = local, high = local;
    low.hi[axis] = high.lo[axis] = local.center()[axis];
    return hidden_by_parts(high, splits_left - 1) && hidden_by_parts(low, splits_left - 1);
  }

  void visit(std::uint32_t index, VisibleSet& open) {
    const BvhNode& node = scene_.bvh()[index];
    if (node.box.empty() || !open.any_in(node.first, node.count)) return;
    const Box local = frame_.local_around_world(node.box);
    if (hidden(local)) {
      if (const std::uint32_t group = group_of_watched(watched_, open, node); group > 0) {
        found_.assign(1, {local, *hidden_by_});
        note(group);
      }
      open.remove_range(node.first, node.count);
      return;
    }
    if (node.child != 0) {
      visit(node.child, open);
      visit(node.child + 1, open);
      return;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const ObjectId id{i};
      if (!open.contains(id)) continue;
      noting_ = watched_ != nullptr && id == watched_->object;
      found_.clear();
      if (hidden_by_parts(frame_.local_around_world(scene_.object(id).box), splits_))
        open.remove(id);
      if (noting_ && !open.contains(id)) note(1);
      noting_ = false;
    }
  }

  // What provers before this one noted is of no interest any more.
  void note(std::uint32_t objects) {
    *watched_ = {.object = watched_->object, .method = Method::kSweep};
    for (const auto& [local, plane] : found_) {
      watched_->parts.push_back({local, watched_->planes.size(), objects, {}});
      watched_->planes.push_back(plane);
    }
  }

  const Scene& scene_;
  const CellFrame& frame_;
  std::span<const Maps> faces_;
  Evidence* watched_;
  bool noting_ = false;                         // the box being tested is of the watched object
  const ProjectionPlane* hidden_by_ = nullptr;  // of the last box found hidden
  std::vector<std::pair<Box, ProjectionPlane>> found_;  // hidden parts of the watched object
  int splits_ = 0;
  std::uint32_t box_tests_ = 0;
};

// Eyes and occludees above level ground: what a ray would meet below it never matters (theory 0.3).
bool ground_below(const Scene& scene, const CellFrame& frame) {
  return frame.axes()[2] == Vec3(0, 0, 1) && frame.world_bounds().lo.z >= scene.ground();
}

}  // namespace

// Maps are of bits, and every step costs up to a pixel at each side of a gap.
SweepEffort sweep_effort(const EvaluatorSettings& settings) {
  constexpr int kFiner = 4;  // than other maps
  return {.columns_px = std::min(kFiner * settings.resolution_px, kMaxSweepPx),
          .near_m = settings.near_m};
}

SweepProver::SweepProver(const Scene& scene, const SweepEffort& effort)
    : scene_(scene), effort_(effort) {
  PVS_CHECK(effort.columns_px % 64 == 0 && effort.columns_px <= kMaxSweepPx);
}

// At distances that grow by kStep.
std::vector<SweepPlane> SweepProver::planes_for(const CellFrame& frame, Face face,
                                                const OccludeeExtent& extent) const {
  std::vector<SweepPlane> planes;
  const Box& around = extent.around;
  const double reach = depths(frame, face, around).hi;
  const double width = std::max(frame.half()[face.u()], frame.half()[face.v()]);
  // Level ground gives rows of their own to the height, which is small.
  const bool vertical_is_x = face.u() == 2;
  double distance = std::max(kFirstDistance * width, 1e-3 * reach);
  while (distance < reach && static_cast<int>(planes.size()) < effort_.most_planes) {
    ProjectionPlane plane = square_plane(frame, face, distance, effort_.extent, effort_.columns_px);
    SweepPlane sweep{.along = vertical_is_x ? MapAxis::kY : MapAxis::kX,
                     .row_count = effort_.columns_px / 2,
                     .bound = distance * (1 + 0.5 * kStep)};
    // Along, grids are nearly proportional to the distance, hence aligned. Across: what is of use.
    Box behind = plane.plane_from_local(around);
    behind.lo.z = std::max(behind.lo.z, 0.0);
    const PlaneRect rect = occludee_rect(plane, behind);
    double& from = vertical_is_x ? plane.x0 : plane.y0;
    double& pixel = vertical_is_x ? plane.px : plane.py;
    const double lo = std::max(from, vertical_is_x ? rect.x0 : rect.y0);
    const double hi = std::min(-from, vertical_is_x ? rect.x1 : rect.y1);
    const double least = sweep.row_count * pixel / 16;
    const double range = std::max(1.02 * (hi - lo), least);
    from = 0.5 * (lo + hi) - 0.5 * range;
    pixel = range / sweep.row_count;
    sweep.plane = plane;
    if (hi > lo) planes.push_back(sweep);
    distance *= 1 + kStep;
  }
  return planes;
}

void SweepProver::sweep_face(const Sweep& sweep, Face face) {
  const CellFrame& frame = sweep.frame;
  const std::vector<SweepPlane> planes = planes_for(frame, face, sweep.extent);
  const std::size_t first = map_count_;
  if (maps_.size() < map_count_ + planes.size()) maps_.resize(map_count_ + planes.size());
  const bool has_ground = face.axis != 2 && ground_below(scene_, frame);
  const Vec3 center = frame.world_bounds().center();
  const Vec3 on_ground{center.x, center.y, scene_.ground()};
  const double ground = frame.local_around_world({on_ground, on_ground}).lo.z;
  double before = 0;       // the bound of the plane before
  double last_useful = 0;  // the distance of the last plane that settled enough; 0: none yet
  for (std::size_t k = 0; k < planes.size(); ++k) {
    CoverageBits& map = maps_[map_count_++];
    map.reset(planes[k]);
    if (k > 0) map.gather(maps_[first + k - 1]);
    if (has_ground) map.cover_below(ground);
    const double nearest = nearest_depth(planes[k].plane, effort_.near_m);
    add_occluders(sweep, polygon_plane(planes[k], nearest, frame.offset_scale()), before, map);
    before = planes[k].bound;
    if (k % kPlanesATest != kPlanesATest - 1) continue;

    // What the planes settle, and whether farther ones may be expected to settle anything.
    const std::uint32_t open_before = sweep.open.count();
    const SweepTest::Maps newest[] = {{face, std::span(&map, 1)}};
    SweepTest test(scene_, frame, newest, sweep.evidence);
    test.run(sweep.open, 0);
    sweep.statistics.box_tests += test.box_tests();
    const std::uint32_t settled = open_before - sweep.open.count();
    if (settled > kLeastYield * open_before) last_useful = planes[k].plane.distance;
    if (last_useful > 0 && planes[k].plane.distance > kGiveUp * last_useful) break;
  }
  faces_.push_back({face, first, map_count_ - first});
  sweep.statistics.planes += static_cast<std::uint32_t>(map_count_ - first);
}

// Those between two bounds whose place on the map is not all covered. Drawn at once, so that what
// comes next may turn out hidden.
void SweepProver::add_occluders(const Sweep& sweep, const PolygonPlane& plane, double before,
                                CoverageBits& map) {
  if (tree_->level_count() == 0) return;
  const SlabScreen screen(sweep.frame, plane, map.grid(),
                          {.before = before,
                           .bound = map.where().bound,
                           .ground = scene_.ground(),
                           .ground_depth = sweep.ground_depth});
  SlabScreen::Ranges ranges;
  stack_.assign(1, {tree_->level_count() - 1, 0});
  while (!stack_.empty()) {
    const Visit visit = stack_.back();
    stack_.pop_back();
    unsigned rest = screen.screen(tree_->level(visit.level)[visit.block], ranges);
    const std::uint32_t first = OccluderTree::kWidth * visit.block;
    const Occluder* found[OccluderTree::kWidth];
    int count = 0;
    for (; rest != 0; rest &= rest - 1) {
      const int k = std::countr_zero(rest);
      if (map.all_covered(ranges.of(k))) continue;
      if (visit.level == 0) {
        found[count++] = &scene_.occluders()[tree_->order()[first + k]];
        prefetch(found[count - 1], sizeof(Occluder));
      } else {
        stack_.push_back({visit.level - 1, first + k});
        prefetch(&tree_->level(visit.level - 1)[first + k], sizeof(OccluderTree::Block));
      }
    }
    for (int i = 0; i < count; ++i) prefetch(scene_.points(*found[i]).data(), 3 * sizeof(Vec3));
    for (int i = 0; i < count; ++i) add_occluder(sweep, *found[i], plane, map);
  }
}

void SweepProver::add_occluder(const Sweep& sweep, const Occluder& occluder,
                               const PolygonPlane& plane, CoverageBits& map) {
  const CellFrame& frame = sweep.frame;
  if (occluder.shape == OccluderShape::kPolygon && occluder.point_count <= kMaxCoverPoints) {
    std::array<Vec3, kMaxCoverPoints> points;
    const auto world = scene_.points(occluder);
    for (std::size_t i = 0; i < world.size(); ++i) points[i] = frame.local_from_world(world[i]);
    const auto local = std::span(points).first(world.size());
    const int side = side_of_cell(local, occluder.flatness, frame);
    if (side == 0) return;
    if (occluder.one_sided && side < 0 && !legal_for_cell(scene_, occluder, frame, effort_.near_m))
      return;
    const Cover cover = cover_polygon(plane, local, occluder.flatness, map, shape_);
    sweep.statistics.projections += cover == Cover::kAdded ? 1 : 0;
    if (cover != Cover::kLongWay) return;
  } else if (!legal_for_cell(scene_, occluder, frame, effort_.near_m)) {
    return;
  }
  occluders_.list.clear();
  occluders_.points.clear();
  coverages_.clear();
  add_local(scene_, occluder, frame, sweep.ground_depth, 0, occluders_);
  std::array<Piece, 2> pieces;
  const ProjectionPlane& on = map.where().plane;
  const int count = make_pieces(occluders_, occluders_.list[0], on, effort_.near_m, pieces);
  for (int p = 0; p < count; ++p)
    if (pieces[p].box.hi.z <= plane.deepest)
      sweep.statistics.projections +=
          project(pieces[p], on, frame.offset_scale(), coverages_) ? 1 : 0;
  map.draw(coverages_);
}

MapsUsed SweepProver::maps_used() const {
  MapsUsed used;
  for (const CoverageBits& map : std::span(maps_).first(map_count_))
    add_plane(map.where().plane, used);
  return used;
}

void SweepProver::run(const Cell& cell, VisibleSet& visible, VisibleSet& open,
                      CellStatistics& statistics, Evidence* evidence) {
  faces_.clear();
  map_count_ = 0;
  if (open.count() == 0) return;
  const CellFrame frame(cell);
  const double reach = length(scene_.bounds().size()) + length(frame.half()) +
                       length(scene_.bounds().center() - cell.center());
  const double ground_depth = cell.bounds().lo.z >= scene_.ground() ? 4 * reach : 0;
  const OccludeeExtent extent = extent_of(scene_, frame, open);
  const Sweep sweep{frame, extent, ground_depth, open, statistics, evidence};
  VisibleSet hidden = open;
  if (!tree_) tree_.emplace(scene_);
  for (const Face face : kFaces) {
    const double nearest_side =
        face.sign > 0 ? extent.highest_lo[face.axis] : -extent.lowest_hi[face.axis];
    if (nearest_side > frame.half()[face.axis]) sweep_face(sweep, face);
  }

  std::vector<SweepTest::Maps> maps;
  for (const FaceMaps& f : faces_)
    maps.push_back({f.face, std::span<const CoverageBits>(maps_).subspan(f.first, f.count)});
  SweepTest test(scene_, frame, maps, evidence);
  test.run(open, effort_.splits);
  statistics.box_tests += test.box_tests();
  hidden.remove_all(open);
  visible.remove_all(hidden);
}

}  // namespace pvsfarm

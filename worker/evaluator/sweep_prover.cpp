#include "worker/evaluator/sweep_prover.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/check.hpp"
#include "worker/visibility/occludee_test.hpp"

namespace pvsfarm {
namespace {

constexpr double kKernelPx = 5;  // a step's footprint beside the pixel itself, 1024 pixels a side
constexpr double kLeastStep = 0.05, kMostStep = 0.08;  // of the distance
constexpr double kFirstDistance = 2;                   // of the cell's half width

// Depth beyond the face of a box of the local frame.
struct DepthRange {
  double lo, hi;
};
DepthRange depths(const CellFrame& frame, Face face, const Box& box) {
  const double a = face.sign * box.lo[face.axis], b = face.sign * box.hi[face.axis];
  const double half = frame.half()[face.axis];
  return {std::min(a, b) - half, std::max(a, b) - half};
}

// Tests boxes of occludees against the maps of all faces.
class SweepTest {
 public:
  struct Maps {
    Face face;
    std::span<const CoverageBits> maps;
  };
  SweepTest(const Scene& scene, const CellFrame& frame, std::span<const Maps> faces)
      : scene_(scene), frame_(frame), faces_(faces) {}

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
        if (map.covered(occludee_rect(plane, box))) return true;
      }
    }
    return false;
  }

  bool hidden_by_parts(const Box& local, int splits_left) {
    if (hidden(local)) return true;
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
    if (hidden(frame_.local_around_world(node.box))) {
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
      if (open.contains(id) &&
          hidden_by_parts(frame_.local_around_world(scene_.object(id).box), splits_))
        open.remove(id);
    }
  }

  const Scene& scene_;
  const CellFrame& frame_;
  std::span<const Maps> faces_;
  int splits_ = 0;
  std::uint32_t box_tests_ = 0;
};

// Eyes and occludees above level ground: what a ray would meet below it never matters (theory 0.3).
bool ground_below(const Scene& scene, const CellFrame& frame) {
  return frame.axes()[2] == Vec3(0, 0, 1) && frame.world_bounds().lo.z >= scene.ground();
}

}  // namespace

SweepProver::SweepProver(const Scene& scene, const SweepEffort& effort)
    : scene_(scene), effort_(effort), tree_(scene) {
  PVS_CHECK(effort.columns_px % 64 == 0 && effort.columns_px <= kMaxSweepPx);
}

// Steps as long as the kernel allows (theory B.2), but neither so short nor so long a part of the
// distance that nothing is gained.
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
    const double kernel = kKernelPx * (vertical_is_x ? plane.py : plane.px);
    const double step =
        width > 0 ? std::clamp(kernel / (2 * width), kLeastStep, kMostStep) : kMostStep;
    SweepPlane sweep{.along = vertical_is_x ? MapAxis::kY : MapAxis::kX,
                     .row_count = effort_.columns_px / 2,
                     .bound = distance * (1 + 0.5 * step)};
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
    distance *= 1 + step;
  }
  return planes;
}

void SweepProver::sweep_face(const CellFrame& frame, Face face, const OccludeeExtent& extent,
                             double ground_depth, CellStatistics& statistics) {
  const std::vector<SweepPlane> planes = planes_for(frame, face, extent);
  faces_.push_back({face, map_count_, planes.size()});
  if (maps_.size() < map_count_ + planes.size()) maps_.resize(map_count_ + planes.size());
  statistics.planes += static_cast<std::uint32_t>(planes.size());
  const bool has_ground = face.axis != 2 && ground_below(scene_, frame);
  const Vec3 center = frame.world_bounds().center();
  const Vec3 on_ground{center.x, center.y, scene_.ground()};
  const double ground = frame.local_around_world({on_ground, on_ground}).lo.z;
  std::array<Piece, 2> pieces;
  double before = 0;  // the bound of the plane before
  for (std::size_t k = 0; k < planes.size(); ++k) {
    CoverageBits& map = maps_[map_count_ + k];
    const ProjectionPlane& plane = planes[k].plane;
    map.reset(planes[k]);
    if (k > 0) map.gather(maps_[map_count_ + k - 1]);
    if (has_ground) map.cover_below(ground);
    coverages_.clear();
    const double nearest = -plane.distance + std::max(plane.distance / 64, effort_.near_m);
    const double farthest = planes[k].bound - plane.distance;
    const auto of_no_use = [&](const Box& world) {
      Box local = frame.local_around_world(world);
      if (ground_depth > 0 && world.lo.z <= scene_.ground()) local.lo.z -= ground_depth;
      const DepthRange range = depths(frame, face, local);
      if (range.hi <= before || range.lo >= planes[k].bound) return true;
      Box box = plane.plane_from_local(local);
      box.lo.z = std::max(box.lo.z, nearest);
      box.hi.z = std::min(box.hi.z, farthest);
      return !(box.lo.z <= box.hi.z) || map.settled(occludee_rect(plane, box));
    };
    stack_.assign(tree_.nodes().empty() ? 0 : 1, 0);
    while (!stack_.empty()) {
      const OccluderTree::Node& node = tree_.nodes()[stack_.back()];
      stack_.pop_back();
      if (of_no_use(node.box())) continue;
      if (node.count == 0) {
        stack_.push_back(node.first);
        stack_.push_back(node.first + 1);
        continue;
      }
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const Occluder& occluder = scene_.occluders()[tree_.order()[i]];
        if (of_no_use(occluder.box)) continue;
        if (!legal_for_cell(scene_, occluder, frame, effort_.near_m)) continue;
        occluders_.list.clear();
        occluders_.points.clear();
        add_local(scene_, occluder, frame, ground_depth, 0, occluders_);
        const int count =
            make_pieces(occluders_, occluders_.list[0], plane, effort_.near_m, pieces);
        for (int p = 0; p < count; ++p)
          if (pieces[p].box.hi.z <= farthest)
            statistics.projections +=
                project(pieces[p], plane, frame.offset_scale(), coverages_) ? 1 : 0;
      }
      // At once, so that what comes next may turn out hidden.
      map.draw(coverages_);
      coverages_.clear();
    }
    before = planes[k].bound;
  }
  map_count_ += planes.size();
}

void SweepProver::note(const CellFrame& frame, Evidence& evidence) const {
  constexpr int kSidePx = 256;
  const Box box = frame.local_around_world(scene_.object(evidence.object).box);
  ProjectionPlane last;
  last.distance = 0;
  for (const FaceMaps& f : faces_)
    for (std::size_t m = f.first; m < f.first + f.count; ++m) {
      const SweepPlane& where = maps_[m].where();
      if (where.bound < depths(frame, f.face, box).lo && where.plane.distance > last.distance)
        last = square_plane(frame, f.face, where.plane.distance, effort_.extent, kSidePx);
    }
  if (last.distance == 0 && !faces_.empty())  // hidden in parts, none of which is all of it
    last = square_plane(frame, faces_[0].face, 1, effort_.extent, kSidePx);
  evidence.planes = {last};
  evidence.occluders = {};
  evidence.parts = {{box, 0, 1}};
}

void SweepProver::run(const Cell& cell, VisibleSet& visible, VisibleSet& open,
                      CellStatistics& statistics, Evidence* evidence) {
  if (open.count() == 0) return;
  const CellFrame frame(cell);
  const double reach = length(scene_.bounds().size()) + length(frame.half()) +
                       length(scene_.bounds().center() - cell.center());
  const double ground_depth = cell.bounds().lo.z >= scene_.ground() ? 4 * reach : 0;
  const OccludeeExtent extent = extent_of(scene_, frame, open);
  faces_.clear();
  map_count_ = 0;
  for (const Face face : kFaces) {
    const double nearest_side =
        face.sign > 0 ? extent.highest_lo[face.axis] : -extent.lowest_hi[face.axis];
    if (nearest_side > frame.half()[face.axis])
      sweep_face(frame, face, extent, ground_depth, statistics);
  }

  std::vector<SweepTest::Maps> maps;
  for (const FaceMaps& f : faces_)
    maps.push_back({f.face, std::span<const CoverageBits>(maps_).subspan(f.first, f.count)});
  VisibleSet hidden = open;
  SweepTest test(scene_, frame, maps);
  test.run(open, effort_.splits);
  statistics.box_tests += test.box_tests();
  hidden.remove_all(open);
  visible.remove_all(hidden);
  if (evidence != nullptr && hidden.contains(evidence->object)) note(frame, *evidence);
}

}  // namespace pvsfarm

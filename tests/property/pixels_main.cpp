// Prints digests of what the hot loops make of random worlds: which occluders they pass, depth
// maps, maps of bits, answers to box tests, planes aimed at what is open, re-projected depths, the
// boxes, polygons and re-projections of a sweep, lines of sight. Built once for each instruction
// set that is dispatched to; dispatch_test compares the lines.
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <string>

#include "common/base/check.hpp"
#include "common/base/digest.hpp"
#include "common/base/random.hpp"
#include "common/scene/scene_build.hpp"
#include "tests/property/random_scenes.hpp"
#include "worker/visibility/box_on_planes.hpp"
#include "worker/visibility/coverage_bits.hpp"
#include "worker/visibility/direct_raster.hpp"
#include "worker/visibility/occluder_screen.hpp"
#include "worker/visibility/plane_choice.hpp"
#include "worker/visibility/sight_check.hpp"
#include "worker/visibility/slab_screen.hpp"

namespace pvsfarm {
namespace {

constexpr std::uint64_t kWorldsPerFamily = 6;
constexpr int kSidePx = 128;

struct Results {
  DigestBuilder passed, depths, bits, answers, planes, gathered, screened, swept, lines;
  std::uint64_t pixels = 0, covered_bits = 0, hidden = 0, aimed = 0, gathered_pixels = 0,
                screened_boxes = 0, polygons = 0, clear_lines = 0;
};

void draw(const CellFrame& frame, const LocalOccluders& occluders, OccluderScreen& screen,
          OcclusionMap& map, Results& results) {
  CoverageList coverages;
  std::array<Piece, 2> pieces;
  for (const OccluderScreen::Passed& one : screen.pass(map.plane(), 0, 0)) {
    const std::uint32_t i = one.index;
    results.passed.add_u64(i);
    const int count = make_pieces(occluders, occluders.list[i], map.plane(), 0, pieces);
    for (int p = 0; p < count; ++p)
      project(pieces[p], map.plane(), frame.offset_scale(), coverages);
  }
  DirectRaster().draw(coverages, map);
  map.build_pyramids();
  const std::span<const float> drawn(map.base(), std::size_t{kSidePx} * kSidePx);
  for (const float depth : drawn) results.pixels += std::isfinite(depth);
  results.depths.add(std::as_bytes(drawn));
  results.depths.add_f64(map.lowest());

  CoverageBits bits;
  bits.reset({map.plane(), MapAxis::kX, kSidePx, map.plane().distance * 1.5});
  bits.draw(coverages);
  results.covered_bits += bits.covered_pixels();
  for (int j = 0; j < kSidePx; ++j)
    for (int i = 0; i < kSidePx; ++i) results.bits.add_u64(bits.covered_at(i, j));
}

void ask(const Scene& scene, const CellFrame& frame, std::span<const OcclusionMap> maps,
         Results& results) {
  for (std::size_t first = 0; first < maps.size();) {
    BoxOnPlanes group;
    const std::size_t count = group.set(maps.subspan(first));
    for (const ObjectRecord& object : scene.objects()) {
      group.place(frame.local_around_world(object.box));
      for (std::size_t k = 0; k < count; ++k) {
        const PlaneAnswer answer = group.answer(k);
        results.answers.add_u64(static_cast<std::uint64_t>(answer));
        results.hidden += answer == PlaneAnswer::kHidden;
      }
    }
    first += count;
  }
}

// What each map certifies about the farther ones of its face.
void gather(std::span<const OcclusionMap> maps, Results& results) {
  Reprojection reprojection;
  for (const OcclusionMap& from : maps)
    for (const OcclusionMap& to : maps) {
      const ProjectionPlane &near = from.plane(), &far = to.plane();
      if (near.face.axis != far.face.axis || near.face.sign != far.face.sign ||
          !(near.distance < far.distance))
        continue;
      OcclusionMap gathered;
      gathered.reset(far);
      reprojection.gather(from, gathered);
      const std::span<const float> depths(gathered.base(), std::size_t{kSidePx} * kSidePx);
      for (const float depth : depths) results.gathered_pixels += std::isfinite(depth);
      results.gathered.add(std::as_bytes(depths));
    }
}

void add_polygon(const Scene& scene, const CellFrame& frame, const Occluder& occluder,
                 const PolygonPlane& plane, CoverageBits& map, Results& results) {
  if (occluder.shape != OccluderShape::kPolygon || occluder.point_count > kMaxCoverPoints) return;
  std::array<Vec3, kMaxCoverPoints> points;
  const auto world = scene.points(occluder);
  for (std::size_t i = 0; i < world.size(); ++i) points[i] = frame.local_from_world(world[i]);
  const auto local = std::span(points).first(world.size());
  if (side_of_cell(local, occluder.flatness, frame) == 0) return;
  RowShape shape;
  results.polygons +=
      cover_polygon(plane, local, occluder.flatness, map, shape) == Cover::kAdded ? 1 : 0;
}

// Three planes of a face, each with what the one before it certifies.
void sweep_face(const Scene& scene, const CellFrame& frame, const OccluderTree& tree, Face face,
                Results& results) {
  CoverageBits maps[3];
  double before = 0, distance = length(frame.half());
  for (int k = 0; k < 3; ++k, distance *= 1.5) {
    const SweepPlane where{square_plane(frame, face, distance, 1.1, kSidePx), MapAxis::kX, kSidePx,
                           distance * 1.2};
    CoverageBits& map = maps[k];
    map.reset(where);
    if (k > 0) map.gather(maps[k - 1]);
    const PolygonPlane plane =
        polygon_plane(where, nearest_depth(where.plane, 0), frame.offset_scale());
    const SlabScreen screen(frame, plane, map.grid(), {.before = before, .bound = where.bound});
    for (std::size_t b = 0; b < tree.level(0).size(); ++b) {
      SlabScreen::Ranges ranges;
      const unsigned found = screen.screen(tree.level(0)[b], ranges);
      results.screened.add_u64(found);
      for (unsigned rest = found; rest != 0; rest &= rest - 1) {
        const int box = std::countr_zero(rest);
        const BitRange range = ranges.of(box);
        for (const int pixel :
             {range.along_first, range.along_last, range.across_first, range.across_last})
          results.screened.add_u64(static_cast<std::uint64_t>(pixel));
        ++results.screened_boxes;
        add_polygon(scene, frame, scene.occluders()[tree.order()[OccluderTree::kWidth * b + box]],
                    plane, map, results);
      }
    }
    before = where.bound;
    for (int j = 0; j < kSidePx; ++j)
      for (int i = 0; i < kSidePx; ++i) results.swept.add_u64(map.covered_at(i, j));
  }
}

void look(const std::shared_ptr<const Scene>& scene, const Cell& cell, Random& random,
          Results& results) {
  const SightCheck sight(scene);
  const double margin = sight.margin_for(length(cell.center() - sight.origin()) +
                                         length(cell.half()) + sight.radius());
  for (std::uint32_t i = 0; i < scene->object_count(); ++i) {
    const Box& box = scene->object(ObjectId{i}).box;
    const Vec3 t{random.unit(), random.unit(), random.unit()};
    const Sightline line{cell.corner(static_cast<int>(i % 8)), box.lo + (box.hi - box.lo) * t};
    const bool clear = sight.clear(line, ObjectId{i}, margin);
    const auto hit = sight.first_hit(line);
    results.clear_lines += clear ? 1 : 0;
    results.lines.add_u64(clear).add_u64(hit ? hit->triangle : ~0u).add_f64(hit ? hit->t : 2);
  }
}

void add_world(Family family, std::uint64_t seed, Results& results) {
  const RandomWorld world = random_world(family, seed);
  const auto built = build_scene(world.source);
  PVS_CHECK(built.ok());
  const Scene& scene = *built.value();
  const VisibleSet open = VisibleSet::all(scene.object_count());
  const OccluderTree tree(scene);
  Random random(seed);
  for (const Cell& cell : world.cells) {
    const CellFrame frame(cell);
    LocalOccluders occluders;
    OccluderScreen screen;
    for (const Occluder& occluder : scene.occluders()) {
      if (!legal_for_cell(scene, occluder, frame, 0)) continue;
      add_local(scene, occluder, frame, 0, 1, occluders);
      screen.add(occluders.list.back().box);
    }
    const auto planes = choose_planes(frame, occluders,
                                      {.planes_per_face = 3,
                                       .resolution_px = kSidePx,
                                       .occludees = extent_of(scene, frame, open)});
    std::vector<OcclusionMap> maps(planes.size());
    for (std::size_t m = 0; m < planes.size(); ++m) {
      maps[m].reset(planes[m]);
      draw(frame, occluders, screen, maps[m], results);
    }
    ask(scene, frame, maps, results);
    gather(maps, results);
    if (tree.level_count() > 0)
      for (const Face face : kFaces) sweep_face(scene, frame, tree, face, results);
    look(built.value(), cell, random, results);
    for (const ProjectionPlane& plane :
         aim_planes(scene, frame, occluders, open, {.planes = 4, .resolution_px = kSidePx})) {
      results.planes.add_f64(plane.distance).add_f64(plane.x0).add_f64(plane.py);
      ++results.aimed;
    }
  }
}

void print(const char* what, std::uint64_t count, DigestBuilder& digest) {
  std::printf("%s %llu %s\n", what, static_cast<unsigned long long>(count),
              digest.finish().hex().c_str());
}

}  // namespace
}  // namespace pvsfarm

int main() {
  using namespace pvsfarm;
  Results results;
  for (const Family family : kFamilies)
    for (std::uint64_t seed = 1; seed <= kWorldsPerFamily; ++seed) add_world(family, seed, results);
  print("passed", 1, results.passed);
  print("pixels", results.pixels, results.depths);
  print("bits", results.covered_bits, results.bits);
  print("hidden", results.hidden, results.answers);
  print("planes", results.aimed, results.planes);
  print("gathered", results.gathered_pixels, results.gathered);
  print("screened", results.screened_boxes, results.screened);
  print("polygons", results.polygons, results.swept);
  print("lines", results.clear_lines, results.lines);
}

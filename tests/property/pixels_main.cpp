// Prints digests of what the hot loops make of random worlds: which occluders they pass, depth
// maps, maps of bits, answers to box tests, planes aimed at what is open. Built once for each
// instruction set that is dispatched to; dispatch_test compares the lines.
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "common/base/check.hpp"
#include "common/base/digest.hpp"
#include "common/scene/scene_build.hpp"
#include "tests/property/random_scenes.hpp"
#include "worker/visibility/box_on_planes.hpp"
#include "worker/visibility/coverage_bits.hpp"
#include "worker/visibility/direct_raster.hpp"
#include "worker/visibility/occluder_screen.hpp"
#include "worker/visibility/plane_choice.hpp"

namespace pvsfarm {
namespace {

constexpr std::uint64_t kWorldsPerFamily = 6;
constexpr int kSidePx = 128;

struct Results {
  DigestBuilder passed, depths, bits, answers, planes;
  std::uint64_t pixels = 0, covered_bits = 0, hidden = 0, aimed = 0;
};

void draw(const CellFrame& frame, const LocalOccluders& occluders, OccluderScreen& screen,
          OcclusionMap& map, Results& results) {
  CoverageList coverages;
  std::array<Piece, 2> pieces;
  for (const std::uint32_t i : screen.pass(map.plane(), 0, 0)) {
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

void add_world(Family family, std::uint64_t seed, Results& results) {
  const RandomWorld world = random_world(family, seed);
  const auto built = build_scene(world.source);
  PVS_CHECK(built.ok());
  const Scene& scene = *built.value();
  const VisibleSet open = VisibleSet::all(scene.object_count());
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
}

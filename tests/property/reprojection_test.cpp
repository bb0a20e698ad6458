// Re-projection from map to map: every pixel that a gather covers keeps its ray certificate, over
// two steps; the printed form, which resets depths, does not. And where the papers' convolution
// covers, the gather covers, too.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "common/base/random.hpp"
#include "common/scene/scene_build.hpp"
#include "tests/adversarial/reference/reprojection.hpp"
#include "tests/support/make_objects.hpp"
#include "tests/support/ray_oracle.hpp"
#include "worker/visibility/direct_raster.hpp"
#include "worker/visibility/reprojection.hpp"

namespace pvsfarm {
namespace {

using reference::Depth;

constexpr int kSidePx = 64;
constexpr std::uint64_t kWorlds = 60;
constexpr int kRaysPerPixel = 12;

// 25 boxes and triangles between the cell and a little beyond the first plane, and three planes.
struct World {
  Cell cell;
  SceneSource source;
  ProjectionPlane planes[3];
  OcclusionMap first;
};

World random_world_before_planes(std::uint64_t seed) {
  Random random(seed);
  World world;
  Vec3 half;
  for (int a = 0; a < 3; ++a) half[a] = 0.1 + 1.4 * random.unit() * random.unit();
  world.cell = Cell::aligned({-half, half});
  const double d1 = random.between(1.5, 5), d2 = d1 * random.between(1.05, 1.8),
               d3 = d2 * random.between(1.05, 1.5);
  for (int i = 0; i < 25; ++i) {
    const Vec3 c{random.between(-6, 6), random.between(-6, 6),
                 half.z + random.between(0.2, 1.6 * d1)};
    const double s = random.between(0.5, 4);
    const std::string name = "o" + std::to_string(i);
    if (random.below(2) == 0) {
      const Vec3 r{random.between(0.02, 1) * s, random.between(0.02, 1) * s,
                   random.between(0.02, 0.3) * s};
      world.source.objects.push_back(box_object(name, {c - r, c + r}));
    } else {
      Vec3 points[3];
      for (Vec3& p : points)
        p = c + Vec3{random.between(-s, s), random.between(-s, s), random.between(-s, s)};
      world.source.objects.push_back(polygon_object(name, points));
    }
    world.source.objects.back().two_sided = true;
  }
  const CellFrame frame(world.cell);
  const Face face{2, 1};
  world.planes[0] = square_plane(frame, face, d1, random.between(0.8, 1.6), kSidePx);
  world.planes[1] = square_plane(frame, face, d2, random.between(0.8, 1.6), kSidePx);
  world.planes[2] = square_plane(frame, face, d3, random.between(0.8, 1.6), 2 * kSidePx);
  const auto scene = build_scene(world.source);
  PVS_CHECK(scene.ok());
  LocalOccluders occluders;
  for (const Occluder& occluder : scene.value()->occluders())
    if (legal_for_cell(*scene.value(), occluder, frame, 0))
      add_local(*scene.value(), occluder, frame, 0, 0, occluders);
  CoverageList coverages;
  for (const LocalOccluder& occluder : occluders.list) {
    std::array<Piece, 2> pieces;
    const int count = make_pieces(occluders, occluder, world.planes[0], 0, pieces);
    for (int k = 0; k < count; ++k)
      project(pieces[k], world.planes[0], frame.offset_scale(), coverages);
  }
  world.first.reset(world.planes[0]);
  DirectRaster().draw(coverages, world.first);
  return world;
}

struct Tally {
  std::uint64_t covered = 0, broken = 0;  // pixels
};

// Rays from the cell through each covered pixel, as far as its depth: all must meet matter.
void try_certificates(const OcclusionMap& map, const RayOracle& oracle, const World& world,
                      Random& random, Tally& tally) {
  const ProjectionPlane& plane = map.plane();
  const double margin = oracle.margin_for(world.cell.bounds());
  const int side = plane.resolution_px;
  for (int pixel = 0; pixel < side * side; ++pixel) {
    const double depth = map.base()[pixel];
    if (!std::isfinite(depth)) continue;
    ++tally.covered;
    bool broken = false;
    for (int k = 0; k < kRaysPerPixel && !broken; ++k) {
      const double a = random.between(-1, 1), b = random.between(-1, 1), c = random.unit();
      const Vec3 eye{a * plane.hu, b * plane.hv, -plane.distance - 2 * plane.hw * c};
      const Vec3 p{plane.x0 + plane.px * (pixel % side + random.unit()),
                   plane.y0 + plane.py * (pixel / side + random.unit()), 0};
      const Vec3 end = eye + (p - eye) * ((depth - eye.z) / -eye.z);
      const Vec3 to_world{0, 0, plane.hw + plane.distance};
      broken = oracle.clear_by({eye + to_world, end + to_world}, 4 * margin);
    }
    tally.broken += broken;
  }
}

TEST(Reprojection, keeps_the_ray_certificate_of_every_pixel_it_covers) {
  Tally second, third, reset;
  Reprojection reprojection;
  for (std::uint64_t seed = 1; seed <= kWorlds; ++seed) {
    const World world = random_world_before_planes(seed);
    const RayOracle oracle(world.source);
    Random random(seed);
    OcclusionMap b, c, printed;
    b.reset(world.planes[1]);
    c.reset(world.planes[2]);
    printed.reset(world.planes[1]);
    reprojection.gather(world.first, b);
    reprojection.gather(b, c);
    reference::reproject(world.first, printed, Depth::kResetToPlane);
    try_certificates(b, oracle, world, random, second);
    try_certificates(c, oracle, world, random, third);
    try_certificates(printed, oracle, world, random, reset);
    ASSERT_EQ(second.broken + third.broken, 0u) << "seed " << seed;
  }
  std::cout << "covered pixels: second plane " << second.covered << ", third " << third.covered
            << "; with depths reset " << reset.broken << " of " << reset.covered << " broken\n";
  EXPECT_GT(second.covered, 30'000u);
  EXPECT_GT(third.covered, 30'000u);
  // The same rays find the fault of the printed form: they would find one of the gather's.
  EXPECT_GT(reset.broken * 50, reset.covered);
}

TEST(Reprojection, covers_what_the_plain_double_loop_covers_at_the_same_depths) {
  Reprojection reprojection;
  for (std::uint64_t seed = 1; seed <= kWorlds; ++seed) {
    const World world = random_world_before_planes(seed);
    OcclusionMap gathered, plain;
    gathered.reset(world.planes[2]);
    plain.reset(world.planes[2]);
    reprojection.gather(world.first, gathered);
    reference::reproject(world.first, plain, Depth::kKept);
    const int pixels = world.planes[2].resolution_px * world.planes[2].resolution_px;
    for (int i = 0; i < pixels; ++i) {
      const float a = gathered.base()[i], b = plain.base()[i];
      ASSERT_EQ(std::isfinite(a), std::isfinite(b)) << "seed " << seed << ", pixel " << i;
      if (std::isfinite(a)) {
        ASSERT_NEAR(a, b, 1e-5) << "seed " << seed;
      }
    }
  }
}

TEST(Reprojection, lowers_depths_and_never_raises_one) {
  const World world = random_world_before_planes(7);
  OcclusionMap map;
  map.reset(world.planes[1]);
  const int pixels = kSidePx * kSidePx;
  std::fill(map.base(), map.base() + pixels, -1000.0f);
  Reprojection().gather(world.first, map);
  for (int i = 0; i < pixels; ++i) ASSERT_EQ(map.base()[i], -1000.0f);
}

// The convolution for the equivalent cell, on grids aligned as it needs them.
TEST(Reprojection, covers_all_that_the_convolution_for_the_equivalent_cell_covers) {
  std::uint64_t by_convolution = 0, by_gather = 0;
  Reprojection reprojection;
  for (std::uint64_t seed = 1; seed <= kWorlds; ++seed) {
    const World world = random_world_before_planes(seed);
    const OcclusionMap& from = world.first;
    for (const int kernel_px : {3, 5, 9}) {
      const auto convolved = reference::convolve(from, kernel_px);
      if (!convolved) continue;
      OcclusionMap gathered;
      gathered.reset(convolved->plane());
      reprojection.gather(from, gathered);
      for (int i = 0; i < kSidePx * kSidePx; ++i) {
        const bool in_convolved = std::isfinite(convolved->base()[i]);
        const bool in_gathered = std::isfinite(gathered.base()[i]);
        ASSERT_TRUE(in_gathered || !in_convolved)
            << "seed " << seed << ", kernel " << kernel_px << ", pixel " << i;
        by_convolution += in_convolved;
        by_gather += in_gathered;
      }
    }
  }
  std::cout << "covered pixels: gather " << by_gather << ", convolution " << by_convolution << '\n';
  EXPECT_GT(by_convolution, 30'000u);
}

}  // namespace
}  // namespace pvsfarm

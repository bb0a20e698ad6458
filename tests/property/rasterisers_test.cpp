// Three rasterisers on the same occluders: the direct one, the OSMesa one, and appendix A's stencil
// method from the tests' own code. What OSMesa covers the direct one covers, never farther; what
// the stencil covers, with its larger shrink, both do. And every covered pixel keeps its ray
// certificate (theory 0.4), as rays in double tell.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <iostream>

#include "common/base/random.hpp"
#include "common/scene/scene_build.hpp"
#include "tests/property/random_scenes.hpp"
#include "tests/support/ray_oracle.hpp"
#include "tests/support/stencil_reference.hpp"
#include "worker/visibility/direct_raster.hpp"
#include "worker/visibility/osmesa_raster.hpp"

namespace pvsfarm {
namespace {

constexpr int kSidePx = 64;
constexpr std::uint64_t kWorldsPerFamily = 30;
constexpr std::size_t kMostPieces = 300;  // the stencil method takes a tenth of a ms for each

// A plane before a face of a cell, and the pieces of a world that can be projected on it.
struct Projected {
  Family family = Family::kBlocks;
  std::uint64_t seed = 0;
  Cell cell;
  ProjectionPlane plane;
  std::vector<Piece> pieces;
  CoverageList coverages;
};

Projected set_up(const RandomWorld& world, const Scene& scene, Family family, std::uint64_t seed) {
  Random random(seed);
  Projected s;
  s.family = family;
  s.seed = seed;
  // Wide cells: what an occluder hides from their corners it need not hide from between.
  s.cell = world.cells[seed % world.cells.size()];
  for (int a = 0; a < 3; ++a) {
    const double more = s.cell.half()[a] * random.between(0, 4);
    s.cell.lo[a] -= more;
    s.cell.hi[a] += more;
  }
  const CellFrame frame(s.cell);
  LocalOccluders occluders;
  for (const Occluder& occluder : scene.occluders())
    if (legal_for_cell(scene, occluder, frame, 0))
      add_local(scene, occluder, frame, 0, 0, occluders);
  // Most planes cut an occluder: there a Projection that is not split at the plane is wrong.
  s.plane = square_plane(frame, kFaces[random.below(2) == 0 ? 0 : random.below(6)], 1, 1, kSidePx);
  double distance = length(scene.bounds().size()) * random.between(0.02, 0.6);
  if (!occluders.list.empty() && random.below(4) != 0) {
    const Box& box = occluders.list[random.below(occluders.list.size())].box;
    const double t = random.unit();
    distance = std::max(distance / 50, s.plane.beyond_face(box.lo * t + box.hi * (1 - t)));
  }
  s.plane = square_plane(frame, s.plane.face, distance, random.between(0.3, 2), kSidePx);
  for (const LocalOccluder& occluder : occluders.list) {
    std::array<Piece, 2> pieces;
    const int count = make_pieces(occluders, occluder, s.plane, 0, pieces);
    for (int p = 0; p < count && s.pieces.size() < kMostPieces; ++p)
      if (project(pieces[p], s.plane, frame.offset_scale(), s.coverages))
        s.pieces.push_back(pieces[p]);
  }
  return s;
}

std::vector<Projected> all_projected() {
  std::vector<Projected> setups;
  for (Family family : kFamilies)
    for (std::uint64_t seed = 1; seed <= kWorldsPerFamily; ++seed) {
      const RandomWorld world = random_world(family, seed);
      const auto scene = build_scene(world.source);
      PVS_CHECK(scene.ok());
      setups.push_back(set_up(world, *scene.value(), family, seed));
    }
  return setups;
}

std::vector<float> drawn(Rasteriser& rasteriser, const Projected& setup) {
  OcclusionMap map;
  map.reset(setup.plane);
  rasteriser.draw(setup.coverages, map);
  return {map.base(), map.base() + kSidePx * kSidePx};
}

struct Agreement {
  std::uint64_t covered_by_inner = 0, covered_by_outer = 0;
};

// Every pixel of `inner` is covered in `outer`, at a depth not farther but for `slack` of the
// range.
void expect_inside(const std::vector<float>& inner, const std::vector<float>& outer, double slack,
                   const Projected& setup, Agreement& agreement) {
  for (std::size_t i = 0; i < inner.size(); ++i) {
    agreement.covered_by_inner += std::isfinite(inner[i]);
    agreement.covered_by_outer += std::isfinite(outer[i]);
    ASSERT_LE(outer[i], inner[i] + slack) << to_string(setup.family) << ", seed " << setup.seed
                                          << ", pixel " << i % kSidePx << ", " << i / kSidePx;
  }
}

double depth_range(const Projected& setup) {
  double range = setup.plane.distance;
  for (const Piece& piece : setup.pieces) range = std::max(range, std::abs(piece.box.hi.z));
  return 2 * range;
}

TEST(Rasterisers, cover_what_the_stencil_method_covers_and_osmesa_no_more_than_direct) {
  const std::vector<Projected> setups = all_projected();
  std::vector<std::vector<float>> direct, osmesa, stencil;
  DirectRaster by_rows;
  for (const Projected& setup : setups) direct.push_back(drawn(by_rows, setup));
  {  // one OSMesa context at a time
    OsmesaRaster by_osmesa(kSidePx);
    for (const Projected& setup : setups) osmesa.push_back(drawn(by_osmesa, setup));
  }
  StencilReference by_stencil(kSidePx);
  for (const Projected& setup : setups)
    stencil.push_back(by_stencil.draw(setup.pieces, setup.plane));

  Agreement osmesa_in_direct, stencil_in_osmesa, stencil_in_direct;
  for (std::size_t i = 0; i < setups.size(); ++i) {
    const double slack = 1e-6 * depth_range(setups[i]);
    expect_inside(osmesa[i], direct[i], 0, setups[i], osmesa_in_direct);
    expect_inside(stencil[i], direct[i], slack, setups[i], stencil_in_direct);
    expect_inside(stencil[i], osmesa[i], slack, setups[i], stencil_in_osmesa);
    if (HasFatalFailure()) return;
  }
  std::cout << setups.size() << " maps; pixels covered: stencil "
            << stencil_in_direct.covered_by_inner << ", OSMesa "
            << osmesa_in_direct.covered_by_inner << ", direct " << osmesa_in_direct.covered_by_outer
            << '\n';
  // They differ by slivers only; a rasteriser that covers nothing would be inside anything.
  EXPECT_GT(stencil_in_direct.covered_by_inner, 10'000u);
  EXPECT_GT(osmesa_in_direct.covered_by_inner * 100, osmesa_in_direct.covered_by_outer * 97);
  EXPECT_GT(stencil_in_direct.covered_by_inner * 100, stencil_in_direct.covered_by_outer * 90);
}

// From any viewpoint of the cell through any point of a covered pixel, matter is met before Z.
TEST(Rasterisers, keep_the_ray_certificate_of_every_covered_pixel) {
  constexpr int kRaysPerPixel = 4;
  std::uint64_t rays = 0, broken = 0;
  DirectRaster by_rows;
  for (Family family : kFamilies)
    for (std::uint64_t seed = 101; seed < 101 + kWorldsPerFamily; ++seed) {
      const RandomWorld world = random_world(family, seed);
      const auto scene = build_scene(world.source);
      ASSERT_TRUE(scene.ok());
      const Projected s = set_up(world, *scene.value(), family, seed);
      const std::vector<float> map = drawn(by_rows, s);
      const RayOracle oracle(world.source);
      const Cell& cell = s.cell;
      const double margin = oracle.margin_for(cell.bounds());
      Random random(seed);
      // The plane's frame in the world.
      const Vec3 x = cell.axes[s.plane.face.u()], y = cell.axes[s.plane.face.v()];
      const Vec3 z = cell.axes[s.plane.face.axis] * static_cast<double>(s.plane.face.sign);
      const Vec3 origin = cell.center() + z * (s.plane.hw + s.plane.distance);
      const auto world_point = [&](const Vec3& p) { return origin + x * p.x + y * p.y + z * p.z; };
      for (std::size_t pixel = 0; pixel < map.size(); ++pixel) {
        if (!std::isfinite(map[pixel])) continue;
        for (int k = 0; k < kRaysPerPixel; ++k) {
          const bool corner = random.next() & 1;
          const auto part = [&] {
            return corner ? static_cast<double>(random.next() & 1) : random.unit();
          };
          const double u = part(), v = part();
          const Vec3 p{s.plane.x0 + s.plane.px * (pixel % kSidePx + u),
                       s.plane.y0 + s.plane.py * (pixel / kSidePx + v), 0};
          const double a = 2 * part() - 1, b = 2 * part() - 1, c = part();
          const Vec3 eye{a * s.plane.hu, b * s.plane.hv, -s.plane.distance - 2 * s.plane.hw * c};
          const Vec3 end = eye + (p - eye) * ((map[pixel] - eye.z) / -eye.z);
          ++rays;
          broken += oracle.clear_by({world_point(eye), world_point(end)}, 4 * margin);
        }
      }
      ASSERT_EQ(broken, 0u) << to_string(family) << ", seed " << seed;
    }
  std::cout << rays << " rays through covered pixels\n";
  EXPECT_GT(rays, 100'000u);
}

}  // namespace
}  // namespace pvsfarm

// The evaluator's improved Projection on maps that hold one convex polygon, where visibility has an
// exact answer. Planes and maps are made here, so that nothing but the test itself is judged.
//
//   PVSFARM_SCENES=N   at least N random scenes
#include "worker/visibility/improved_test.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>

#include "tests/adversarial/case_file.hpp"
#include "tests/adversarial/reference/improved_scenes.hpp"
#include "tests/adversarial/reference/scene_count.hpp"
#include "worker/visibility/direct_raster.hpp"
#include "worker/visibility/occludee_test.hpp"

namespace pvsfarm {
namespace {

using reference::improved_scene;
using reference::PlaneRectangle;

constexpr std::uint64_t kScenes = 5000;
constexpr int kSidePx = 64;

Cell cell_of(const Box& box) {
  Cell cell;
  cell.lo = box.lo;
  cell.hi = box.hi;
  return cell;
}

// A cell, a plane beyond its upper face, and the map of a polygon on it.
struct Drawn {
  Drawn(const Box& cell, double plane_z, const PlaneRectangle& window,
        const std::vector<Vec3>& polygon)
      : frame(cell_of(cell)) {
    ProjectionPlane plane = square_plane(frame, Face{2, 1}, plane_z - cell.hi.z, 1, kSidePx);
    plane.x0 = window.lo[0];
    plane.y0 = window.lo[1];
    plane.px = (window.hi[0] - window.lo[0]) / kSidePx;
    plane.py = (window.hi[1] - window.lo[1]) / kSidePx;
    Piece piece;
    for (const Vec3& p : polygon) {
      piece.points[piece.point_count] = plane.plane_from_local(frame.local_from_world(p));
      piece.box.add(piece.points[piece.point_count++]);
    }
    CoverageList coverages;
    project(piece, plane, frame.offset_scale(), coverages);
    map.reset(plane);
    DirectRaster().draw(coverages, map);
    map.build_pyramids();
  }
  bool plain(const Box& box) const {
    return test_box(map, frame.local_around_world(box)) == PlaneAnswer::kHidden;
  }
  bool improved(const Box& box) const {
    return improved_test(map, frame.local_around_world(box)).has_value();
  }
  CellFrame frame;
  OcclusionMap map;
};

constexpr Box kCell{{-2, -2, -2}, {2, 2, 0}};
constexpr PlaneRectangle kWindow{{-16, -16}, {16, 16}};

std::vector<Vec3> plate(double half, double z) {
  return {{-half, -half, z}, {half, -half, z}, {half, half, z}, {-half, half, z}};
}

// The umbra of this plate ends at z = 12.
TEST(ImprovedTest, hides_behind_a_plate_narrower_than_the_cell_what_rule_p_cannot) {
  const Box box{{-0.1, -0.1, 3.2}, {0.1, 0.1, 3.3}};
  const Drawn d(kCell, 6, kWindow, plate(1.5, 3));
  EXPECT_FALSE(d.plain(box));
  EXPECT_TRUE(d.improved(box));
  EXPECT_FALSE(Drawn(kCell, 14, kWindow, plate(1.5, 3)).improved(box));
}

// On the plane the umbra is 0.8 <= x <= 2.6; all views of the box have -1.4 <= x <= 1.4 in common.
TEST(ImprovedTest, finds_the_covered_pixel_that_is_not_in_the_middle) {
  std::vector<Vec3> aside = plate(1.5, 3);
  for (Vec3& p : aside) p.x += 0.9;
  EXPECT_TRUE(Drawn(kCell, 6, kWindow, aside).improved({{-0.1, -0.1, 3.2}, {0.1, 0.1, 3.3}}));
}

TEST(ImprovedTest, leaves_to_rule_p_what_lies_behind_the_plane) {
  const Drawn d(kCell, 4, kWindow, plate(10, 3));
  EXPECT_TRUE(d.plain({{-0.1, -0.1, 5}, {0.1, 0.1, 6}}));
  EXPECT_FALSE(d.improved({{-0.1, -0.1, 5}, {0.1, 0.1, 6}}));
}

TEST(ImprovedTest, hides_a_box_across_the_plane_only_with_both_its_parts) {
  const Drawn d(kCell, 4, kWindow, plate(6, 3));
  EXPECT_TRUE(d.improved({{-0.1, -0.1, 3.5}, {0.1, 0.1, 5}}));
  EXPECT_FALSE(d.improved({{-0.1, -0.1, 3.5}, {9, 0.1, 5}}));
}

TEST(ImprovedTest, hides_nothing_before_the_matter_or_across_the_face) {
  const Drawn d(kCell, 4, kWindow, plate(10, 3));
  EXPECT_FALSE(d.improved({{-0.1, -0.1, 2.9}, {0.1, 0.1, 3.5}}));
  EXPECT_FALSE(d.improved({{-0.1, -0.1, -0.5}, {0.1, 0.1, 3.5}}));
  EXPECT_FALSE(d.improved({{2.5, -0.1, 0}, {2.6, 0.1, 3.5}}));
}

TEST(ImprovedTest, of_one_convex_polygon_hides_only_what_is_hidden) {
  std::uint64_t hidden = 0, plain = 0, must_not = 0;
  for (std::uint64_t seed = 1; seed <= reference::scene_count(kScenes); ++seed) {
    const auto s = improved_scene(seed, 0.1);
    PlaneRectangle window = s.rectangle;  // with room around it, in pixels much smaller than it
    for (int a = 0; a < 2; ++a) {
      const double around = std::max(0.2 * (s.rectangle.hi[a] - s.rectangle.lo[a]), 0.01);
      window.lo[a] -= around;
      window.hi[a] += around;
    }
    const Drawn d(s.query.cell, 0, window, s.occluder);
    const bool truth = hides(ExactPolygon(s.occluder), s.query.cell, s.query.occludee);
    const bool ours = d.improved(s.query.occludee);
    EXPECT_TRUE(truth || !ours) << "scene " << seed;
    hidden += ours;
    plain += d.plain(s.query.occludee);
    must_not += !truth;
  }
  std::cout << "hidden " << hidden << ", of these by rule P " << plain << "; not hidden in truth "
            << must_not << '\n';
  EXPECT_GT(hidden * 5, reference::scene_count(kScenes));
  EXPECT_GT(hidden, 2 * plain);
  EXPECT_GT(must_not, 0u);
}

}  // namespace
}  // namespace pvsfarm

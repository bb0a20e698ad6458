// Parts of methods at their limits: determinants, the kernel of a sweep, the depth of what is
// re-projected, and a child that cannot prove what its parent proved.
#include <gtest/gtest.h>

#include "common/scene/scene_build.hpp"
#include "coordinator/tree/tree.hpp"
#include "tests/adversarial/case_file.hpp"
#include "tests/adversarial/reference/integer_geometry.hpp"
#include "tests/adversarial/reference/reprojection.hpp"
#include "tests/support/evaluation.hpp"
#include "tests/support/make_objects.hpp"
#include "worker/visibility/direct_raster.hpp"
#include "worker/visibility/occludee_test.hpp"

namespace pvsfarm {
namespace {

using namespace reference;

// Case 53.
TEST(Determinant, of_entries_of_20_bits_is_exact_up_to_its_extremes) {
  constexpr std::int64_t k = kLargestEntry;
  std::int64_t most = 0, least = 0;
  for (int signs = 0; signs < 512; ++signs) {
    IntPoint rows[3];
    for (int e = 0; e < 9; ++e) rows[e / 3][e % 3] = (signs >> e & 1) ? k : -k;
    const std::int64_t det = determinant(rows[0], rows[1], rows[2]);
    __int128 wide = 0;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, m = (i + 2) % 3;
      wide += static_cast<__int128>(rows[0][i]) * rows[1][j] * rows[2][m] -
              static_cast<__int128>(rows[0][i]) * rows[1][m] * rows[2][j];
    }
    ASSERT_TRUE(static_cast<__int128>(det) == wide) << signs;
    most = std::max(most, det), least = std::min(least, det);
  }
  EXPECT_EQ(most, std::int64_t{1} << 62);
  EXPECT_EQ(least, -(std::int64_t{1} << 62));
}

TEST(Determinant, one_step_of_the_grid_off_a_plane_is_told_at_any_size) {
  constexpr std::int64_t k = kLargestDifference / 2 - 8;
  const IntPoint a{{-k, -k, 0}}, b{{k, -k + 1, 0}}, c{{-k + 3, k, 1}};
  for (const std::int64_t off : {-1, 0, 1}) {
    const IntPoint across{{b[0] + c[0] - a[0], b[1] + c[1] - a[1], b[2] + c[2] - a[2] + off}};
    EXPECT_EQ(orientation(a, b, c, across), off);
  }
}

// Case 45.
TEST(SweepKernel, has_the_pixels_it_was_spaced_for_only_with_the_resolution_in_the_formula) {
  const Spacing s{
      .distance = 10, .cell_width = 4, .plane_width = 32, .resolution_px = 64, .kernel_px = 5};
  EXPECT_EQ(spacing(s), 5);
  EXPECT_EQ(kernel_px(s, spacing(s)), 4);  // and the pixel itself
  EXPECT_EQ(spacing_as_printed(s), 320);   // the proceedings
  EXPECT_EQ(kernel_px(s, spacing_as_printed(s)), 256);
  // On the first plane, its grid that of the second scaled from the cell.
  const ProjectionPlane near{.distance = 10, .hu = 2, .hv = 2, .px = 32.0 / 64 * 10 / 15};
  const ProjectionPlane far{.distance = 15, .hu = 2, .hv = 2, .px = 32.0 / 64};
  for (const double x : {-16.0, 0.0, 3.5}) {
    const Footprint f = footprint(near, far, 0, x, x + far.px);
    EXPECT_NEAR((f.hi - f.lo) / near.px, 5, 1e-12);
    EXPECT_NEAR(f.lo / near.px, x / far.px - 2, 1e-9);
  }
}

// The case's plate on its plane, carried to z = 10 and compared there.
bool hidden_after_reprojection(const VisibilityCase& c, Depth depth) {
  const PlacedCase p = placed(c, 0);
  const CellFrame frame(p.cell);
  const auto scene = build_scene(p.source).value();
  const auto plane_at = [&](double z) {
    return square_plane(frame, Face{2, 1}, z - c.cell.hi.z, 1, 64);
  };
  LocalOccluders occluders;
  for (const Occluder& occluder : scene->occluders())
    if (legal_for_cell(*scene, occluder, frame, 0))
      add_local(*scene, occluder, frame, 0, 0, occluders);
  OcclusionMap near, far;
  near.reset(plane_at(*c.plane_z));
  CoverageList coverages;
  for (const LocalOccluder& occluder : occluders.list) {
    std::array<Piece, 2> pieces;
    const int count = make_pieces(occluders, occluder, near.plane(), 0, pieces);
    for (int k = 0; k < count; ++k)
      project(pieces[k], near.plane(), frame.offset_scale(), coverages);
  }
  DirectRaster().draw(coverages, near);
  far.reset(plane_at(10));
  reproject(near, far, depth);
  far.build_pyramids();
  return test_box(far, frame.local_around_world(c.occludee)) == PlaneAnswer::kHidden;
}

VisibilityCase case_named(const std::string& id) {
  for (const VisibilityCase& c : all_cases())
    if (c.id == id) return c;
  throw std::out_of_range(id);
}

TEST(Reprojection, keeps_the_depth_of_an_occluder_behind_the_first_plane) {
  EXPECT_TRUE(hidden_after_reprojection(case_named("reproj_reset_depth"), Depth::kResetToPlane));
  EXPECT_FALSE(hidden_after_reprojection(case_named("reproj_reset_depth"), Depth::kKept));
  EXPECT_TRUE(hidden_after_reprojection(case_named("reproj_behind_ok"), Depth::kKept));
}

TEST(Reprojection, hides_no_case_that_is_seen) {
  for (const VisibilityCase& c : cases_that(Must::kVisible))
    if (c.plane_z && *c.plane_z > c.cell.hi.z && *c.plane_z < 10) {
      EXPECT_FALSE(hidden_after_reprojection(c, Depth::kKept)) << c.id;
    }
}

// What a worker may say of a cell: nothing seen, no viewpoint measured.
CellDelta delta_of(const CellKey& key, const VisibleSet& hidden) {
  return {key, hidden, VisibleSet::none(hidden.universe()), 0, {}};
}

// Case 50.
TEST(TreeOfCells, what_the_parent_hides_stays_hidden_though_the_child_alone_cannot_prove_it) {
  SceneSource source;
  source.objects = {box_object("wall", {{10, -12, -12}, {10.5, 12, 12}}, Role::kOnlyOccludes),
                    box_object("hidden", {{14, -1, -1}, {15, 1, 1}}, Role::kOnlyOccluded),
                    box_object("seen", {{4, -1, -1}, {5, 1, 1}}, Role::kOnlyOccluded)};
  const Cell root = Cell::aligned({{-1, -1, -1}, {1, 1, 1}});
  EvaluatorSettings settings, weak;
  weak.methods = Methods{Method::kAimedRays};  // looks for what is seen, proves nothing hidden
  Evaluation by_parent(source, settings), by_child(source, weak);
  const ObjectId hidden = by_parent.id_of(1), seen = by_parent.id_of(2);
  Tree tree(TreeScene::of(by_parent.scene()), {root}, {.budget_triangles = 1, .min_cell_m = 0.1});
  const CellKey parent{0, 1}, child{0, 2};

  const VisibleSet of_parent =
      by_parent.evaluator().evaluate(parent, root, tree.occludees()).hidden;
  ASSERT_TRUE(of_parent.contains(hidden));
  ASSERT_TRUE(tree.merge(delta_of(parent, of_parent)).value().split());
  ASSERT_TRUE(by_child.hidden_from(*tree.cell(child)).empty());
  const auto merged = tree.merge(delta_of(child, VisibleSet::none(tree.object_count()))).value();
  EXPECT_FALSE(merged.visible.contains(hidden));
  EXPECT_TRUE(merged.visible.contains(seen));
}

}  // namespace
}  // namespace pvsfarm

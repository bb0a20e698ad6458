// The visible cases once more, a plane at a time: projected on the very plane each was built for
// and on many others, near and far, coarse and fine, no plane may call the occludee hidden. The
// evaluator's own choice of planes is good at keeping out of trouble; soundness must not need it.
// Neither by rule P nor by the improved Projection.
#include <gtest/gtest.h>

#include <cmath>

#include "common/scene/scene_build.hpp"
#include "tests/adversarial/case_file.hpp"
#include "worker/visibility/direct_raster.hpp"
#include "worker/visibility/improved_test.hpp"
#include "worker/visibility/occludee_test.hpp"
#include "worker/visibility/osmesa_raster.hpp"

namespace pvsfarm {
namespace {

constexpr int kSidesPx[] = {64, 256};
constexpr double kExtents[] = {0.5, 1.1, 2.5};

class EveryPlane : public testing::TestWithParam<VisibilityCase> {
 protected:
  void SetUp() override {
    placed_ = placed(GetParam(), 0);
    const auto built = build_scene(placed_.source);
    ASSERT_TRUE(built.ok());
    scene_ = built.value();
    for (std::uint32_t i = 0; i < scene_->object_count(); ++i)
      if (scene_->object(ObjectId{i}).file_index == placed_.occludee)
        occludee_ = scene_->object(ObjectId{i}).box;
  }

  // Distances beyond the face: the plane of the case, if it has one, then a sweep.
  std::vector<double> distances(const Face& face, const CellFrame& frame) const {
    std::vector<double> all;
    for (double d = 0.03; d < 60; d *= 1.2) all.push_back(d);
    if (face.axis == 2 && face.sign == 1 && GetParam().plane_z)
      all.push_back(*GetParam().plane_z - placed_.cell.center().z - frame.half().z);
    return all;
  }

  void expect_not_hidden(Rasteriser& rasteriser, const ProjectionPlane& plane,
                         const CellFrame& frame, const LocalOccluders& occluders) const {
    CoverageList coverages;
    for (const LocalOccluder& occluder : occluders.list) {
      std::array<Piece, 2> pieces;
      const int count = make_pieces(occluders, occluder, plane, 0, pieces);
      for (int p = 0; p < count; ++p) project(pieces[p], plane, frame.offset_scale(), coverages);
    }
    OcclusionMap map;
    map.reset(plane);
    rasteriser.draw(coverages, map);
    map.build_pyramids();
    const Box local_box = frame.local_around_world(occludee_);
    EXPECT_TRUE(test_box(map, local_box) != PlaneAnswer::kHidden && !improved_test(map, local_box))
        << "axis " << plane.face.axis << ", sign " << plane.face.sign << ", distance "
        << plane.distance << ", " << plane.resolution_px << " px, half side " << -plane.x0;
  }

  void judge(Rasteriser& rasteriser, int side_px) const {
    const CellFrame frame(placed_.cell);
    LocalOccluders occluders;
    for (const Occluder& occluder : scene_->occluders())
      if (legal_for_cell(*scene_, occluder, frame, 0))
        add_local(*scene_, occluder, frame, 0, 0, occluders);
    for (const Face& face : kFaces)
      for (const double distance : distances(face, frame))
        for (const double extent : kExtents)
          expect_not_hidden(rasteriser, square_plane(frame, face, distance, extent, side_px), frame,
                            occluders);
  }

  PlacedCase placed_;
  std::shared_ptr<const Scene> scene_;
  Box occludee_;
};

TEST_P(EveryPlane, leaves_what_is_seen_open) {
  DirectRaster rasteriser;
  for (const int side_px : kSidesPx) judge(rasteriser, side_px);
}

TEST_P(EveryPlane, leaves_what_is_seen_open_with_osmesa) {
  OsmesaRaster rasteriser(kSidesPx[0]);
  judge(rasteriser, kSidesPx[0]);
}

INSTANTIATE_TEST_SUITE_P(Cases, EveryPlane, testing::ValuesIn(cases_that(Must::kVisible)),
                         [](const auto& test) { return test.param.id; });

}  // namespace
}  // namespace pvsfarm

// The objects of a city's cell, explained: the answers must be the evaluator's own.
#include <gtest/gtest.h>

#include "common/scene/scene_build.hpp"
#include "coordinator/generate/generate.hpp"
#include "worker/evaluator/evaluator.hpp"
#include "worker/inquiry/explain.hpp"

namespace pvsfarm {
namespace {

double sum_of_shares(const ExplainFinding::Part& part) {
  double sum = 0;
  for (const Blocker& blocker : part.blockers) sum += blocker.share;
  return sum;
}

void expect_complete(const ExplainFinding& finding, const ExplainFinding::Part& part) {
  EXPECT_EQ(part.covered, 1);
  EXPECT_GT(part.pixels, 0);
  if (part.blockers.size() < kMaxBlockers) {
    EXPECT_NEAR(sum_of_shares(part), 1, 1e-12);
  }
  EXPECT_GT(part.plane.distance_m + part.depth_m, 0);
  EXPECT_TRUE(finding.unblocked.empty());
}

void explain_all(const std::shared_ptr<const Scene>& scene, const Cell& cell,
                 const EvaluatorSettings& settings, std::uint32_t step) {
  const VisibleSet parent = all_occludees(*scene);
  const CellKey key{.root = 7};
  const CellDelta delta = Evaluator(scene, settings).evaluate(key, cell, parent);
  VisibleSet visible = parent;
  visible.remove_all(delta.hidden);
  ASSERT_GT(delta.hidden.count(), 0u);
  Explainer explainer(scene, settings);
  std::uint32_t in_groups = 0;
  parent.for_each([&](ObjectId id) {
    if (index_of(id) % step != 0) return;
    SCOPED_TRACE(std::string(scene->name(id)));
    const ExplainFinding finding =
        explainer.explain({.key = key, .cell = cell, .parent = parent, .object = id});
    EXPECT_EQ(finding.visible, visible);
    EXPECT_EQ(finding.verdict == Verdict::kHidden, delta.hidden.contains(id));
    EXPECT_EQ(finding.verdict == Verdict::kSeen && !finding.found_afterwards,
              delta.seen.contains(id));
    if (finding.verdict == Verdict::kHidden) {
      ASSERT_FALSE(finding.parts.empty());
      for (const auto& part : finding.parts) expect_complete(finding, part);
      in_groups += finding.parts[0].objects > 1 ? 1 : 0;
    }
    if (finding.verdict == Verdict::kSeen) {
      EXPECT_TRUE(cell.bounds().contains(finding.line.eye));
      EXPECT_TRUE(scene->object(id).box.contains(finding.line.point));
      for (const PassedBy& passed : finding.passed) EXPECT_NE(passed.object, id);
    }
    // What Projections would have covered was nobody's to prove, if they were not asked.
    if (finding.verdict == Verdict::kOpen && settings.methods.has(Method::kProjection)) {
      for (const auto& part : finding.parts) EXPECT_LT(part.covered, 1);
    }
  });
  EXPECT_GT(in_groups, 0u);
}

class ExplainedCity : public testing::TestWithParam<RasterKind> {
 protected:
  void SetUp() override {
    auto city = generate_city({.blocks = 2, .seed = 5});
    ASSERT_TRUE(city.ok());
    city_ = std::move(city).value();
    scene_ = build_scene(city_.source).value();
  }
  GeneratedScene city_;
  std::shared_ptr<const Scene> scene_;
};

TEST_P(ExplainedCity, AnswersAreTheEvaluatorsOwn) {
  const std::uint32_t step = GetParam() == RasterKind::kDirect ? 1 : 8;  // OSMesa takes its time
  explain_all(scene_, city_.cells[city_.cells.size() / 3].cell, {.raster = GetParam()}, step);
}

// Whatever a method hides, lines do not refute, and name who stands there.
TEST_P(ExplainedCity, AnswersOfEveryMethodAreTheEvaluatorsOwn) {
  if (GetParam() != RasterKind::kDirect) GTEST_SKIP() << "no other method is drawn by OpenGL";
  // Boxes are no solids of slices: those of the city's houses are drawn as Projections.
  for (const Method method : {Method::kSurfaces, Method::kSweep}) {
    SCOPED_TRACE(to_string(method));
    EvaluatorSettings settings{.gap = 0};
    settings.methods = {Method::kAimedRays, Method::kImproved, Method::kSlices, method};
    explain_all(scene_, city_.cells[city_.cells.size() / 3].cell, settings, 4);
  }
}

INSTANTIATE_TEST_SUITE_P(Rasters, ExplainedCity,
                         testing::Values(RasterKind::kDirect, RasterKind::kOsmesa),
                         [](const auto& suite) { return std::string(to_string(suite.param)); });

}  // namespace
}  // namespace pvsfarm

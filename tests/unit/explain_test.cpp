// Why objects are seen, hidden or open, in tiny scenes where anybody can tell.
#include "worker/inquiry/explain.hpp"

#include <gtest/gtest.h>

#include "common/scene/scene_build.hpp"
#include "tests/support/make_objects.hpp"
#include "tests/support/make_solids.hpp"
#include "worker/evaluator/evaluator.hpp"
#include "worker/inquiry/line_check.hpp"

namespace pvsfarm {
namespace {

const Cell kCell = Cell::aligned({{-1, -1, -1}, {1, 1, 1}});
const EvaluatorSettings kProversOnly{.methods = {Method::kProjection}, .max_rays = 0};

// A wall across x, 0.2 thick.
SourceObject wall(std::string name, double x, double y0, double y1, Role role) {
  return box_object(std::move(name), {{x, y0, -40}, {x + 0.2, y1, 40}}, role);
}
SourceObject wall(std::string name, double x, double y0, double y1) {
  return wall(std::move(name), x, y0, y1, Role::kOnlyOccludes);
}
SourceObject target(std::string name, const Box& box) {
  return box_object(std::move(name), box, Role::kOnlyOccluded);
}

// One scene, and questions about its objects by name.
class Asked {
 public:
  explicit Asked(std::vector<SourceObject> objects)
      : scene_(build_scene({.objects = std::move(objects)}).value()) {}

  ObjectId id(std::string_view name) const {
    for (std::uint32_t i = 0; i < scene_->object_count(); ++i)
      if (scene_->name(ObjectId{i}) == name) return ObjectId{i};
    ADD_FAILURE() << "no object " << name;
    return {};
  }
  ExplainFinding about(std::string_view name, const EvaluatorSettings& settings = {}) const {
    return Explainer(scene_, settings)
        .explain({.cell = kCell, .parent = all_occludees(*scene_), .object = id(name)});
  }
  std::string names(const std::vector<ObjectId>& ids) const {
    std::string text;
    for (const ObjectId id : ids) text += std::string(scene_->name(id)) + " ";
    return text;
  }

 private:
  std::shared_ptr<const Scene> scene_;
};

double sum_of_shares(const ExplainFinding::Part& part) {
  double sum = 0;
  for (const Blocker& blocker : part.blockers) sum += blocker.share;
  return sum;
}

void expect_sound(const ExplainFinding& finding) {
  EXPECT_EQ(finding.verdict, Verdict::kHidden);
  EXPECT_GE(finding.lines_checked, 512u);
  EXPECT_TRUE(finding.unblocked.empty());
  for (const auto& part : finding.parts) {
    EXPECT_EQ(part.covered, 1);
    EXPECT_NEAR(sum_of_shares(part), 1, 1e-12);
  }
}

TEST(Explain, AWallHidesABoxAlone) {
  const Asked scene({wall("wall", 5, -40, 40), target("box", {{10, -1, -1}, {11, 1, 1}})});
  const ExplainFinding finding = scene.about("box");
  expect_sound(finding);
  EXPECT_EQ(finding.method, Method::kProjection);
  ASSERT_EQ(finding.parts.size(), 1u);
  const auto& part = finding.parts[0];
  ASSERT_EQ(part.blockers.size(), 1u);
  EXPECT_EQ(scene.names(part.blockers[0].owners), "wall ");
  EXPECT_EQ(part.blockers[0].share, 1);
  EXPECT_EQ(part.objects, 1u);
  EXPECT_FALSE(finding.visible.contains(scene.id("box")));
  // The plane stands before the cell's face at x = 1, and the box beyond it at x = 10.
  EXPECT_EQ(part.plane.away, Vec3(1, 0, 0));
  EXPECT_NEAR(part.plane.origin.x, 1 + part.plane.distance_m, 1e-9);
  EXPECT_NEAR(part.plane.origin.x + part.depth_m, 10, 1e-9);
  EXPECT_EQ(part.box.lo, Vec3(10, -1, -1));
}

TEST(Explain, TwoWallsHideABoxTogether) {
  const Asked scene({wall("left", 5, -40, 0.2), wall("right", 6, -0.5, 40),
                     target("box", {{20, -1, -1}, {21, 1, 1}})});
  const ExplainFinding finding = scene.about("box");
  expect_sound(finding);
  ASSERT_EQ(finding.parts.size(), 1u);
  const auto& blockers = finding.parts[0].blockers;
  ASSERT_EQ(blockers.size(), 2u);
  EXPECT_GE(blockers[0].share, blockers[1].share);
  EXPECT_GT(blockers[1].share, 0.2);
}

TEST(Explain, NeighboursAreHiddenAsAGroup) {
  std::vector<SourceObject> objects{wall("wall", 5, -40, 40)};
  for (int i = 0; i < 5; ++i)
    objects.push_back(
        target("box " + std::to_string(i), {{10, 2.0 * i - 5, -1}, {11, 2.0 * i - 4, 1}}));
  const Asked scene(std::move(objects));
  const ExplainFinding finding = scene.about("box 3");
  expect_sound(finding);
  ASSERT_EQ(finding.parts.size(), 1u);
  EXPECT_EQ(finding.parts[0].objects, 5u);
  EXPECT_NEAR(finding.parts[0].box.lo.y, -5, 1e-9);
  EXPECT_NEAR(finding.parts[0].box.hi.y, 4, 1e-9);
}

// What stretches out of one face's map into another's.
TEST(Explain, ABoxRoundACornerIsHiddenInParts) {
  EvaluatorSettings wide = kProversOnly;
  wide.extent = 2;
  const Asked scene({box_object("north", {{-10, 6, -40}, {14, 6.2, 40}}, Role::kOnlyOccludes),
                     wall("east", 3, -14, 6), target("box", {{10, 2, -1}, {12, 40, 1}})});
  const ExplainFinding finding = scene.about("box", wide);
  expect_sound(finding);
  EXPECT_GE(finding.parts.size(), 2u);
  bool by_north = false, by_east = false;
  for (const auto& part : finding.parts) {
    by_north = by_north || part.plane.away == Vec3(0, 1, 0);
    by_east = by_east || part.plane.away == Vec3(1, 0, 0);
  }
  EXPECT_TRUE(by_north && by_east);
}

TEST(Explain, TheLineThroughASlitTellsItsClearance) {
  const Asked scene({wall("left", 5, -40, -0.5), wall("right", 5, 0.5, 40),
                     target("box", {{10, -1, -1}, {11, 1, 1}})});
  const ExplainFinding finding = scene.about("box");
  EXPECT_EQ(finding.verdict, Verdict::kSeen);
  EXPECT_FALSE(finding.found_afterwards);
  EXPECT_TRUE(finding.parts.empty());
  const Vec3 d = finding.line.point - finding.line.eye;
  EXPECT_LE(std::abs(finding.line.eye.x), 1);
  EXPECT_GE(finding.line.point.x, 10);
  ASSERT_EQ(finding.passed.size(), 2u);
  for (const PassedBy& passed : finding.passed) {
    // Nearest where the line leaves or enters the slit: to that edge of the wall, across the line.
    const double edge = scene.names({passed.object}) == "left " ? -0.5 : 0.5;
    EXPECT_GE(passed.at.x, 4.5);
    EXPECT_LE(passed.at.x, 5.7);
    const double off =
        std::min(std::abs(finding.line.eye.y + d.y * (5 - finding.line.eye.x) / d.x - edge),
                 std::abs(finding.line.eye.y + d.y * (5.2 - finding.line.eye.x) / d.x - edge));
    EXPECT_NEAR(passed.clearance_m, off * std::abs(d.x) / std::hypot(d.x, d.y), 1e-6);
  }
  EXPECT_LE(finding.passed[0].clearance_m, finding.passed[1].clearance_m);
}

TEST(Explain, WithoutWitnessesTheSlitIsFoundAfterwards) {
  const Asked scene({wall("left", 5, -40, -0.5), wall("right", 5, 0.5, 40),
                     target("box", {{10, -1, -1}, {11, 1, 1}})});
  const ExplainFinding finding = scene.about("box", kProversOnly);
  EXPECT_EQ(finding.verdict, Verdict::kSeen);
  EXPECT_TRUE(finding.found_afterwards);
  // And the plane that comes nearest tells how much is missing.
  ASSERT_EQ(finding.parts.size(), 1u);
  EXPECT_GT(finding.parts[0].covered, 0.3);
  EXPECT_LT(finding.parts[0].covered, 1);
  EXPECT_EQ(finding.parts[0].blockers.size(), 2u);
  EXPECT_NEAR(sum_of_shares(finding.parts[0]), finding.parts[0].covered, 1e-12);
}

// Two triangles that touch along their long sides let no line through, and cover no pixel there.
// (To shafts the two are one wall.)
TEST(Explain, ASeamIsOpenAndNamesItsTwoSides) {
  const Vec3 a{5, -40, -40}, b{5, 40, -40}, c{5, 40, 40}, d{5, -40, 40};
  const Asked scene({polygon_object("below", std::array{a, b, c}, Role::kOnlyOccludes),
                     polygon_object("above", std::array{a, c, d}, Role::kOnlyOccludes),
                     target("box", {{10, -1, -1}, {11, 1, 1}})});
  EvaluatorSettings planes;
  planes.methods = {Method::kAimedRays, Method::kProjection, Method::kFineProjection};
  const ExplainFinding finding = scene.about("box", planes);
  EXPECT_EQ(finding.verdict, Verdict::kOpen);
  EXPECT_TRUE(finding.visible.contains(scene.id("box")));
  ASSERT_EQ(finding.parts.size(), 1u);
  EXPECT_GT(finding.parts[0].covered, 0.5);
  EXPECT_LT(finding.parts[0].covered, 1);
  EXPECT_EQ(finding.parts[0].blockers.size(), 2u);
}

EvaluatorSettings alone(Method method) { return {.methods = {method}, .max_rays = 0}; }

// By another method than Projections: the lines tell who stands there.
void expect_named_by_lines(const ExplainFinding& finding, Method method) {
  expect_sound(finding);
  EXPECT_EQ(finding.method, method) << to_string(finding.method);
  for (const auto& part : finding.parts) {
    EXPECT_TRUE(part.by_lines);
    EXPECT_GT(part.pixels, 0);
    EXPECT_GT(part.plane.distance_m, 0);
    EXPECT_LT(part.plane.x0, part.plane.x1);
  }
}

// Its two panels leak along their common edge, each on its own.
TEST(Explain, AFoldedScreenHidesAsOneSurface) {
  const Vec3 a{5, -40, -40}, b{4, 0.1, -40}, c{4, 0.1, 40}, d{5, -40, 40}, e{5, 40, -40},
      f{5, 40, 40};
  SourceObject screen = polygon_object("screen", std::array{a, b, c, d}, Role::kOnlyOccludes);
  append(screen, polygon_object("right", std::array{b, e, f, c}));
  const Asked scene({screen, target("box", {{10, -1, -1}, {11, 1, 1}})});
  EXPECT_NE(scene.about("box", kProversOnly).verdict, Verdict::kHidden);
  const ExplainFinding finding = scene.about("box", alone(Method::kSurfaces));
  expect_named_by_lines(finding, Method::kSurfaces);
  ASSERT_EQ(finding.parts[0].blockers.size(), 1u);
  EXPECT_EQ(scene.names(finding.parts[0].blockers[0].owners), "screen ");
  EXPECT_EQ(finding.parts[0].blockers[0].share, 1);

  const ExplainFinding by_shafts = scene.about("box", alone(Method::kShafts));
  EXPECT_EQ(by_shafts.verdict, Verdict::kHidden);
  EXPECT_EQ(by_shafts.method, Method::kShafts);
  EXPECT_GT(by_shafts.lines_checked, 0u);
  EXPECT_TRUE(by_shafts.unblocked.empty());
  ASSERT_EQ(by_shafts.parts.size(), 1u);
  EXPECT_EQ(by_shafts.parts[0].plane.resolution_px, 0) << "they need none";
  EXPECT_TRUE(by_shafts.parts[0].by_lines);
  EXPECT_EQ(by_shafts.parts[0].covered, 1);
  ASSERT_EQ(by_shafts.parts[0].blockers.size(), 1u);
  EXPECT_EQ(scene.names(by_shafts.parts[0].blockers[0].owners), "screen ");
}

TEST(Explain, TheSectionOfABlockHidesWhatIsInIt) {
  const std::vector<Vec2> notched{{-90, -90}, {90, -90}, {90, 80}, {80, 80}, {80, 90}, {-90, 90}};
  SourceObject block;
  block.name = "block";
  append(block, extruded(notched, 5, 100));
  const Asked scene({block, target("box", {{20, -1, -1}, {21, 1, 1}})});
  const ExplainFinding finding = scene.about("box", alone(Method::kSlices));
  expect_named_by_lines(finding, Method::kSlices);
  EXPECT_EQ(scene.names(finding.parts[0].blockers[0].owners), "block ");
  EXPECT_GT(finding.parts[0].plane.origin.x, 5);
  EXPECT_LT(finding.parts[0].plane.origin.x, 20);
}

TEST(Explain, ASweepNamesTheWallsItHasPassed) {
  const Asked scene({wall("left", 8, -40, 0.2), wall("right", 9, -0.5, 40),
                     target("box", {{60, -1, -1}, {61, 1, 1}})});
  const ExplainFinding finding = scene.about("box", alone(Method::kSweep));
  expect_named_by_lines(finding, Method::kSweep);
  ASSERT_EQ(finding.parts.size(), 1u);
  ASSERT_EQ(finding.parts[0].blockers.size(), 2u);
  EXPECT_GT(finding.parts[0].blockers[1].share, 0.2);
  EXPECT_GT(finding.parts[0].plane.origin.x, 8);
  EXPECT_EQ(finding.parts[0].box.lo, Vec3(60, -1, -1));
}

TEST(Explain, ASweepHidesNeighboursAsAGroup) {
  std::vector<SourceObject> objects{wall("wall", 8, -60, 60)};
  for (int i = 0; i < 5; ++i)
    objects.push_back(
        target("box " + std::to_string(i), {{60, 2.0 * i - 5, -1}, {61, 2.0 * i - 4, 1}}));
  const Asked scene(std::move(objects));
  const ExplainFinding finding = scene.about("box 3", alone(Method::kSweep));
  expect_named_by_lines(finding, Method::kSweep);
  EXPECT_EQ(finding.parts[0].objects, 5u);
}

// What a sweep could not hide keeps the plane of whoever came near.
TEST(Explain, ASweepThatFailsForgetsNoPlane) {
  const Asked scene({wall("left", 8, -40, -0.5), wall("right", 8, 0.5, 40),
                     target("box", {{60, -1, -1}, {61, 1, 1}})});
  EvaluatorSettings settings = kProversOnly;
  settings.methods = {Method::kProjection, Method::kSweep};
  settings.gap = 0;
  const ExplainFinding finding = scene.about("box", settings);
  EXPECT_EQ(finding.verdict, Verdict::kSeen);
  ASSERT_EQ(finding.parts.size(), 1u);
  EXPECT_FALSE(finding.parts[0].by_lines);
  EXPECT_GT(finding.parts[0].covered, 0.3);
}

// The lines must be able to find a certificate out: here is one for a box in plain view.
TEST(Explain, AFalseCertificateIsFoundOut) {
  const Box box{{10, -1, -1}, {11, 1, 1}};
  const auto scene =
      build_scene({.objects = {wall("half a wall", 5, -40, 0.5), box_object("box", box)}}).value();
  const ObjectId id{scene->name(ObjectId{0}) == "box" ? 0u : 1u};
  const ExplainQuestion question{.cell = kCell, .object = id};
  const SightCheck sight(scene);
  ExplainFinding finding{.verdict = Verdict::kHidden, .parts = {{.box = box, .covered = 1}}};
  check_by_lines(*scene, sight, question, finding);
  EXPECT_EQ(finding.lines_checked, 512u);
  EXPECT_EQ(finding.unblocked.size(), kMaxUnblocked);
  for (const SightLine& line : finding.unblocked) {
    EXPECT_TRUE(Box({{-1, -1, -1}, {1, 1, 1}}).contains(line.eye));
    EXPECT_TRUE(box.contains(line.point));
    const Vec3 d = line.point - line.eye;
    EXPECT_GT(line.eye.y + d.y * (5 - line.eye.x) / d.x, 0.5);  // past the wall's end
  }
}

// Beside two faces at once no plane lies wholly between cell and object.
TEST(Explain, AnObjectThatTouchesTheCellHasNoPlane) {
  const Asked scene({wall("wall", 5, -40, 40), target("box", {{0, 0, 0}, {2, 0.5, 0.5}})});
  const ExplainFinding finding = scene.about("box", kProversOnly);
  EXPECT_NE(finding.verdict, Verdict::kHidden);
  EXPECT_TRUE(finding.parts.empty());
}

}  // namespace
}  // namespace pvsfarm

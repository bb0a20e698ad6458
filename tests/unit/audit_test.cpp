// The audit of one cell, in tiny scenes where anybody can tell what it must find.
#include "worker/inquiry/audit.hpp"

#include <gtest/gtest.h>

#include "common/scene/scene_build.hpp"
#include "tests/support/make_objects.hpp"
#include "worker/evaluator/evaluator.hpp"

namespace pvsfarm {
namespace {

const Cell kCell = Cell::aligned({{-1, -1, -1}, {1, 1, 1}});

// A wall before the cell with a window a metre wide, one box behind the window and one behind the
// wall, both small and far.
class Audited : public testing::Test {
 protected:
  Audited() {
    SourceObject wall = box_object("wall", {{5, -500, -500}, {5.2, -0.5, 500}});
    for (const Box& part :
         {Box{{5, 0.5, -500}, {5.2, 500, 500}}, Box{{5, -0.5, -500}, {5.2, 0.5, -0.5}},
          Box{{5, -0.5, 0.5}, {5.2, 0.5, 500}}})
      append(wall, box_object("part", part));
    scene_ = build_scene({.objects = {wall, box_object("seen", {{60, -1, -1}, {62, 1, 1}}),
                                      box_object("hidden", {{60, 80, -1}, {62, 82, 1}})}})
                 .value();
  }

  ObjectId id(std::string_view name) const {
    for (std::uint32_t i = 0; i < scene_->object_count(); ++i)
      if (scene_->name(ObjectId{i}) == name) return ObjectId{i};
    ADD_FAILURE() << "no object " << name;
    return {};
  }
  AuditQuestion question(std::initializer_list<const char*> missing) const {
    AuditQuestion asked{.key = {3, 5},
                        .cell = kCell,
                        .visible = all_occludees(*scene_),
                        .suspects = VisibleSet::none(scene_->object_count()),
                        .seed = 7,
                        .rays = 400};
    for (const char* name : missing) asked.visible.remove(id(name));
    return asked;
  }

  std::shared_ptr<const Scene> scene_;
};

}  // namespace

TEST_F(Audited, a_set_that_has_all_that_is_seen_passes) {
  Auditor auditor(scene_, 0);
  const AuditFinding finding = auditor.audit(question({"hidden"}));
  EXPECT_TRUE(finding.violations.empty());
  EXPECT_EQ(finding.key, (CellKey{3, 5}));
  EXPECT_FALSE(finding.seen.contains(id("hidden")));
  EXPECT_TRUE(finding.seen.contains(id("wall")));
}

TEST_F(Audited, a_small_object_far_behind_a_window_is_missed_by_no_audit) {
  Auditor auditor(scene_, 0);
  const AuditFinding finding = auditor.audit(question({"seen", "hidden"}));
  ASSERT_EQ(finding.violations.size(), 1u);
  EXPECT_EQ(finding.violations[0].object, id("seen"));
  const SightLine& line = finding.violations[0].line;
  for (int a = 0; a < 3; ++a) {
    EXPECT_GE(line.eye[a], -1);
    EXPECT_LE(line.eye[a], 1);
  }
  EXPECT_NEAR(line.point.x, 60, 1e-9);
  // Through the window.
  const double at = (5.1 - line.eye.x) / (line.point.x - line.eye.x);
  for (const int a : {1, 2})
    EXPECT_LT(std::abs(line.eye[a] + at * (line.point[a] - line.eye[a])), 0.5);
}

TEST_F(Audited, a_suspect_is_found_with_hardly_a_ray) {
  Auditor auditor(scene_, 0);
  AuditQuestion asked = question({"seen"});
  asked.suspects = VisibleSet::all(scene_->object_count());
  for (const char* name : {"wall", "hidden"}) asked.suspects.remove(id(name));
  asked.rays = 40;
  EXPECT_EQ(auditor.audit(asked).violations.size(), 1u);
}

TEST_F(Audited, rays_are_kept_to_the_number_asked_for) {
  Auditor auditor(scene_, 0);
  for (const std::uint64_t rays : {0, 10, 1'000}) {
    AuditQuestion asked = question({"hidden"});
    asked.rays = rays;
    EXPECT_LE(auditor.audit(asked).rays, rays + rays / 4 + 8);
  }
}

TEST_F(Audited, equal_questions_get_equal_answers_whatever_was_asked_before) {
  Auditor fresh(scene_, 0), used(scene_, 0);
  (void)used.audit(question({}));
  const AuditFinding a = fresh.audit(question({"seen"})), b = used.audit(question({"seen"}));
  EXPECT_EQ(a.seen, b.seen);
  EXPECT_EQ(a.rays, b.rays);
  ASSERT_EQ(a.violations.size(), b.violations.size());
  EXPECT_EQ(a.violations.at(0).line.eye, b.violations.at(0).line.eye);
}

TEST_F(Audited, what_is_nearer_than_the_near_distance_need_not_be_in_the_set) {
  Auditor auditor(scene_, 1'000);
  EXPECT_TRUE(auditor.audit(question({"seen", "wall"})).violations.empty());
}

}  // namespace pvsfarm

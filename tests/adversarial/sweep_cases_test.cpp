// The visible cases of cases.json against the occlusion sweep alone, with coarse maps and fine.
#include <gtest/gtest.h>

#include "tests/adversarial/case_file.hpp"
#include "tests/support/evaluation.hpp"

namespace pvsfarm {
namespace {

EvaluatorSettings sweep_alone(int resolution_px) {
  EvaluatorSettings settings = provers_only(RasterKind::kDirect);
  settings.methods = {Method::kSweep};
  settings.resolution_px = resolution_px;
  return settings;
}

TEST(SweepCases, leave_what_is_seen_open) {
  for (const VisibilityCase& c : cases_that(Must::kVisible)) {
    const PlacedCase p = placed(c, 0);
    for (const int resolution_px : {64, 256}) {
      Evaluation evaluation(p.source, sweep_alone(resolution_px));
      EXPECT_FALSE(evaluation.hides(p.occludee, p.cell)) << c.id << ", " << resolution_px << " px";
    }
  }
}

// A sweep that hides nothing would pass the test above. What is nearer than its first plane, five
// half widths of the cell away, is not its business.
TEST(SweepCases, hide_what_stands_behind_a_plate) {
  int hidden = 0;
  for (const VisibilityCase& c : all_cases()) {
    if (c.id != "reproj_behind_ok") continue;
    const PlacedCase p = placed(c, 0);
    Evaluation evaluation(p.source, sweep_alone(256));
    hidden += evaluation.hides(p.occludee, p.cell) ? 1 : 0;
  }
  EXPECT_EQ(hidden, 1);
}

}  // namespace
}  // namespace pvsfarm

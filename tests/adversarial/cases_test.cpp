// Every case of cases.json through the real evaluator: whatever rasteriser, resolution, number of
// planes, extent, direction of sight or turn of the cell, what is seen is never hidden; what must
// be hidden is hidden with default settings.
#include <gtest/gtest.h>

#include "tests/adversarial/case_file.hpp"
#include "tests/support/evaluation.hpp"

namespace pvsfarm {

namespace {

using Parameters = std::tuple<VisibilityCase, RasterKind>;

class Case : public testing::TestWithParam<Parameters> {
 protected:
  const VisibilityCase& situation() const { return std::get<0>(GetParam()); }
  EvaluatorSettings defaults() const { return provers_only(std::get<1>(GetParam())); }
  bool hides(const PlacedCase& p, const EvaluatorSettings& settings) const {
    return Evaluation(p.source, settings).hides(p.occludee, p.cell);
  }
  // Coarse and fine, one plane and many, narrow maps and wide ones.
  std::vector<EvaluatorSettings> variants() const {
    const struct {
      int resolution_px, planes_per_face;
      double extent;
    } rows[] = {{64, 1, 0.5}, {64, 16, 4}, {128, 3, 2}, {512, 2, 1.1}, {1024, 1, 0.25}};
    std::vector<EvaluatorSettings> all;
    for (const auto& row : rows) {
      EvaluatorSettings settings = defaults();
      settings.methods = {Method::kProjection};
      settings.resolution_px = row.resolution_px;
      settings.planes_per_face = row.planes_per_face;
      settings.extent = row.extent;
      all.push_back(settings);
    }
    return all;
  }
};

std::string name_of(const testing::TestParamInfo<Parameters>& test) {
  return std::get<0>(test.param).id + "_" + to_string(std::get<1>(test.param));
}

constexpr auto kBothKinds = {RasterKind::kDirect, RasterKind::kOsmesa};

class VisibleCase : public Case {};

TEST_P(VisibleCase, is_never_hidden) {
  for (int placement = 0; placement < kPlacements; ++placement)
    EXPECT_FALSE(hides(placed(situation(), placement), defaults())) << "placement " << placement;
  EXPECT_FALSE(hides(turned(situation()), defaults())) << "turned";
  for (const EvaluatorSettings& settings : variants()) {
    const std::string which = std::to_string(settings.resolution_px) + " px, " +
                              std::to_string(settings.planes_per_face) + " planes";
    EXPECT_FALSE(hides(placed(situation(), 0), settings)) << which;
    EXPECT_FALSE(hides(turned(situation()), settings)) << which << ", turned";
  }
}

INSTANTIATE_TEST_SUITE_P(Cases, VisibleCase,
                         testing::Combine(testing::ValuesIn(cases_that(Must::kVisible)),
                                          testing::ValuesIn(kBothKinds)),
                         name_of);

class HiddenCase : public Case {};

TEST_P(HiddenCase, is_hidden_with_default_settings) {
  for (int placement = 0; placement < kPlacements; ++placement)
    EXPECT_TRUE(hides(placed(situation(), placement), defaults())) << "placement " << placement;
}

INSTANTIATE_TEST_SUITE_P(Cases, HiddenCase,
                         testing::Combine(testing::ValuesIn(cases_that(Must::kHidden)),
                                          testing::ValuesIn(kBothKinds)),
                         name_of);

class AnyCase : public Case {};

// The control: the same boxes with nothing opaque left.
TEST_P(AnyCase, hides_nothing_without_matter) {
  PlacedCase p = placed(situation(), 0);
  for (SourceObject& object : p.source.objects) object.occluder = false;
  EXPECT_FALSE(hides(p, defaults()));
}

INSTANTIATE_TEST_SUITE_P(Cases, AnyCase,
                         testing::Combine(testing::ValuesIn(all_cases()),
                                          testing::ValuesIn(kBothKinds)),
                         name_of);

}  // namespace
}  // namespace pvsfarm

// Settings as a store keeps them: what is written is what is read back.
#include "coordinator/service/bake_identity.hpp"

#include <gtest/gtest.h>

namespace pvsfarm {
namespace {

// Every field off its default, the numbers such that short decimals would not do.
BakeSettings unusual() {
  return {
      .evaluator = {.raster = RasterKind::kOsmesa,
                    .resolution_px = 128,
                    .planes_per_face = 11,
                    .extent = 1.0 / 3,
                    .near_m = 0.1 + 0.2,
                    .methods = {Method::kLookAround, Method::kItemBuffers},
                    .gap = 1e-17,
                    .max_rays = (std::uint64_t{1} << 63) + 1,
                    .time_ms = 2.5,
                    .item_buffer_px = 96,
                    .budget_triangles = 12'345},
      .subdivision = {
          .budget_triangles = 54'321, .min_cell_m = 0.7, .split_gain = 0.3, .merge_tolerance = -1}};
}

TEST(SettingsText, EveryFieldSurvivesBitForBit) {
  for (const BakeSettings& settings : {BakeSettings{}, unusual()}) {
    const auto back = settings_from_json(settings_json(settings, "algorithm 9"));
    ASSERT_TRUE(back.has_value());
    EXPECT_EQ(*back, settings);
    EXPECT_EQ(bake_digest_of({}, {}, *back), bake_digest_of({}, {}, settings));
  }
}

TEST(SettingsText, ALackOrANonsenseIsNoSettings) {
  const std::string whole = settings_json(unusual(), "");
  for (const char* field : {"raster", "methods", "gap", "merge_tolerance", "effort_budget"}) {
    std::string lacking = whole;
    lacking[lacking.find(field)] = 'X';
    EXPECT_FALSE(settings_from_json(lacking).has_value()) << field;
  }
  std::string unknown = whole;
  unknown[unknown.find("look-around")] = 'b';
  EXPECT_FALSE(settings_from_json(unknown).has_value());
  unknown = whole;
  unknown[unknown.find("osmesa")] = 'p';
  EXPECT_FALSE(settings_from_json(unknown).has_value());
  EXPECT_FALSE(settings_from_json("").has_value());
  EXPECT_FALSE(settings_from_json("[1]").has_value());
}

}  // namespace
}  // namespace pvsfarm

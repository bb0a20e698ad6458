// The rounds of a cell's cascade: their bytes, their limit, and that they tell what was done.
#include "common/pvs/rounds.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "common/scene/scene_build.hpp"
#include "coordinator/generate/generate.hpp"
#include "tests/support/make_objects.hpp"
#include "worker/evaluator/evaluator.hpp"

namespace pvsfarm {
namespace {

// Ticks whenever it is looked at: what did anything took time.
double ticks() {
  static double now = 0;
  return ++now;
}

// A city, from a cell in its middle.
CellDelta evaluated(const EvaluatorSettings& settings, CpuClock clock) {
  static const auto made = generate_city({.blocks = 4, .seed = 3}).value();
  static const auto scene = build_scene(made.source).value();
  return Evaluator(scene, settings, clock)
      .evaluate({0, 1}, made.cells[made.cells.size() / 2].cell, all_occludees(*scene));
}

const CascadeRound* first_of(const CellStatistics& statistics, Method method) {
  for (const CascadeRound& round : statistics.rounds)
    if (round.method == method) return &round;
  return nullptr;
}

std::vector<CascadeRound> two_rounds() {
  return {{.method = Method::kAimedRays, .open_objects = 9, .seen_objects = 4, .work = 1ull << 40},
          {.method = Method::kFineProjection,
           .maps = {12, 256, 320, 2.5f, 300, 1.3f},
           .open_objects = 5,
           .open_triangles = ~0ull,
           .hidden_objects = 1,
           .hidden_triangles = 12,
           .cpu_ms = 0.25f}};
}

TEST(Rounds, come_back_from_their_bytes_and_cut_short_or_longer_are_refused) {
  std::vector<std::byte> bytes = encode_rounds(two_rounds());
  std::vector<CascadeRound> back;
  ASSERT_TRUE(decode_rounds(bytes, back));
  EXPECT_EQ(back, two_rounds());
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(decode_rounds(std::span(bytes).first(size), back)) << size;
  bytes.push_back(std::byte{0});
  EXPECT_FALSE(decode_rounds(bytes, back));
}

TEST(Rounds, of_no_method_too_many_or_of_times_that_are_none_are_refused) {
  const auto good = [](const CascadeRound& round) {
    std::vector<CascadeRound> back;
    return decode_rounds(encode_rounds(std::span(&round, 1)), back);
  };
  const CascadeRound sound = two_rounds()[1];
  EXPECT_TRUE(good(sound));
  CascadeRound other = sound;
  other.method = static_cast<Method>(kMethodCount);
  EXPECT_FALSE(good(other));
  for (const float x : {-1.0f, std::numeric_limits<float>::infinity()}) {
    other = sound;
    other.cpu_ms = x;
    EXPECT_FALSE(good(other));
  }
  for (float MapsUsed::*field : {&MapsUsed::nearest_m, &MapsUsed::farthest_m, &MapsUsed::extent}) {
    other = sound;
    other.maps.*field = std::numeric_limits<float>::quiet_NaN();
    EXPECT_FALSE(good(other));
  }
  std::vector<std::byte> many = encode_rounds({});
  many[0] = static_cast<std::byte>(kMaxRounds + 1);
  for (std::size_t i = 0; i <= kMaxRounds; ++i) many.insert(many.end(), 14, std::byte{0});
  std::vector<CascadeRound> back;
  EXPECT_FALSE(decode_rounds(many, back));
  EXPECT_EQ(back.size(), 0u);
}

TEST(Rounds, beyond_their_limit_are_added_to_the_methods_last_one) {
  std::vector<CascadeRound> rounds;
  for (std::uint32_t i = 0; i < 3 * kMaxRounds; ++i)
    append_round(rounds, {.method = static_cast<Method>(i % 3), .seen_objects = 1, .cpu_ms = 1});
  for (int m = 0; m < kMethodCount; ++m) append_round(rounds, {.method = static_cast<Method>(m)});
  EXPECT_LE(rounds.size(), kMaxRounds);
  std::uint32_t seen = 0;
  for (const CascadeRound& round : rounds) seen += round.seen_objects;
  EXPECT_EQ(seen, 3 * kMaxRounds);
  for (int m = 0; m < kMethodCount; ++m)
    EXPECT_TRUE(std::any_of(rounds.begin(), rounds.end(), [&](const CascadeRound& round) {
      return round.method == static_cast<Method>(m);
    })) << m;
}

TEST(Rounds, the_largest_take_no_more_bytes_than_messages_have_room_for) {
  CascadeRound round{.method = Method::kShafts};
  round.maps.planes = round.maps.resolution_px = round.maps.occluders = ~0u;
  round.open_objects = round.hidden_objects = round.seen_objects = ~0u;
  round.open_triangles = round.hidden_triangles = round.seen_triangles = round.work = ~0ull;
  const std::vector<CascadeRound> all(kMaxRounds, round);
  EXPECT_LE(encode_rounds(all).size(), kMaxRounds * kMaxRoundBytes);
}

// What the methods did is what their rounds did, whatever was credited to whom within a round.
void expect_rounds_add_up(const CellStatistics& statistics) {
  StatisticsByMethod sums{};
  for (const CascadeRound& round : statistics.rounds) {
    MethodStatistics& sum = sums[static_cast<std::size_t>(round.method)];
    sum.hidden_objects += round.hidden_objects;
    sum.seen_objects += round.seen_objects;
    sum.hidden_triangles += round.hidden_triangles;
    sum.seen_triangles += round.seen_triangles;
    sum.work += round.work;
    sum.cpu_ms += round.cpu_ms;
  }
  for (int m = 0; m < kMethodCount; ++m) {
    const auto method = static_cast<std::size_t>(m);
    const MethodStatistics& told = statistics.methods[method];
    EXPECT_NEAR(sums[method].cpu_ms, told.cpu_ms, 1e-3 * told.cpu_ms) << m;
    sums[method].cpu_ms = told.cpu_ms;
    EXPECT_EQ(sums[method], told) << m;
  }
}

TEST(Rounds, add_up_to_the_methods_and_each_begins_with_what_the_last_left) {
  for (const double gap : {0.0, 0.1}) {
    const CellDelta delta = evaluated({.gap = gap}, ticks);
    const CellStatistics& statistics = delta.statistics;
    ASSERT_GE(statistics.rounds.size(), 3u);
    expect_rounds_add_up(statistics);
    std::uint64_t open = statistics.rounds.front().open_objects;
    std::uint64_t left = open;
    for (const CascadeRound& round : statistics.rounds) {
      // The improved Projection works within the round of another.
      if (round.method != Method::kImproved) open = left;
      EXPECT_EQ(round.open_objects, open);
      left -= round.hidden_objects + round.seen_objects;
    }
    EXPECT_EQ(delta.hidden.count() + delta.seen.count() + left,
              statistics.rounds.front().open_objects);
  }
}

TEST(Rounds, tell_the_planes_their_pixels_and_how_far_they_lie) {
  const CellDelta delta = evaluated({.gap = 0}, nullptr);
  const CascadeRound* first = first_of(delta.statistics, Method::kProjection);
  const CascadeRound* fine = first_of(delta.statistics, Method::kFineProjection);
  const CascadeRound* rays = first_of(delta.statistics, Method::kAimedRays);
  ASSERT_TRUE(first != nullptr && fine != nullptr && rays != nullptr);
  EXPECT_EQ(first->maps.resolution_px, 128u);  // the first maps are half as fine
  EXPECT_EQ(fine->maps.resolution_px, 256u);
  for (const CascadeRound* round : {first, fine}) {
    EXPECT_GT(round->maps.planes, 0u);
    EXPECT_LE(round->maps.planes, 30u);
    EXPECT_GT(round->maps.occluders, 0u);
    EXPECT_GT(round->maps.nearest_m, 0);
    EXPECT_LT(round->maps.nearest_m, round->maps.farthest_m);
    EXPECT_GT(round->maps.extent, 0.1);
    EXPECT_LT(round->maps.extent, 1.31);
    EXPECT_EQ(round->cpu_ms, 0);  // nobody told the time
  }
  EXPECT_EQ(rays->maps, MapsUsed{});
  EXPECT_GT(rays->work, 0u);
}

// Of the round they are made in, the improved Projection's tests have their own part of the time.
TEST(Rounds, the_improved_projection_is_told_the_time_of_its_tests) {
  const CellStatistics timed = evaluated({.gap = 0}, ticks).statistics;
  const auto of = [&](Method method) { return timed.methods[static_cast<std::size_t>(method)]; };
  ASSERT_GT(of(Method::kImproved).work, 0u);
  // By a clock that ticks when asked, asking it takes as long as the test: nothing is left.
  EXPECT_EQ(of(Method::kImproved).cpu_ms, 0);
  // By one of which every third look takes longer, a test takes 3 more than a look in some rounds,
  // and in others less than nothing, which counts as nothing.
  const auto limping = +[] {
    static double now = 0, looks = 0;
    looks = looks < 2 ? looks + 1 : 0;
    return now += looks == 0 ? 4 : 1;
  };
  const CellStatistics limped = evaluated({.gap = 0}, limping).statistics;
  EXPECT_GT(limped.methods[static_cast<std::size_t>(Method::kImproved)].cpu_ms, 0);
  for (const CascadeRound& round : limped.rounds) EXPECT_GE(round.cpu_ms, 0);
  expect_rounds_add_up(limped);
}

}  // namespace
}  // namespace pvsfarm

// Hints of visibility as bytes: what a step means, what becomes of halves, what a file refuses.
#include <gtest/gtest.h>

#include <cmath>

#include "common/base/file.hpp"
#include "common/pvs/hints_file.hpp"

namespace pvsfarm {
namespace {

VisibleSet set_of(std::initializer_list<std::uint32_t> ids) {
  VisibleSet set = VisibleSet::none(8);
  std::vector<std::uint64_t> words(set.words().begin(), set.words().end());
  for (const std::uint32_t id : ids) words[0] |= std::uint64_t{1} << id;
  return VisibleSet::from_words(8, std::move(words));
}

}  // namespace

TEST(Hints, a_degree_of_nothing_is_said_of_what_nobody_saw_alone) {
  EXPECT_EQ(degree_of(0, 4096), 0);
  EXPECT_EQ(degree_of(1, 4096), 1);
  EXPECT_EQ(degree_of(8, 16), 128);
  EXPECT_EQ(degree_of(4095, 4096), 255);
  EXPECT_EQ(degree_of(16, 16), 255);
}

TEST(Hints, sizes_are_eighths_of_octaves_rounded_down) {
  EXPECT_EQ(size_of(0), 0);
  EXPECT_EQ(size_of(1e-300), 1);  // seen, however small
  EXPECT_EQ(steradians_of(size_of(1)), 1);
  EXPECT_EQ(steradians_of(0), 0);
  for (double angle = 1e-8; angle < 12.6; angle *= 1.01) {
    const double back = steradians_of(size_of(angle));
    EXPECT_LE(back, angle);
    EXPECT_GT(back * std::exp2(0.125), angle * (1 - 1e-12)) << angle;
  }
  EXPECT_LT(size_of(4 * 3.1416), kUnknownHint.size);
}

TEST(Hints, a_whole_has_the_mean_degree_and_the_larger_size_of_its_halves) {
  const HintBytes low = pack_hints(std::vector<VisibilityHint>{{255, 40}, {1, 9}});
  const HintBytes high = pack_hints(std::vector<VisibilityHint>{{0, 0}, {10, 50}});
  const VisibleSet lows = set_of({1, 4}), highs = set_of({3, 4}), whole = set_of({1, 3, 4});
  const HintBytes united = united_hints(whole, {lows, low}, {highs, high});
  ASSERT_EQ(united.size(), 6u);
  EXPECT_EQ(hint_at(united, 0), (VisibilityHint{128, 40}));  // from one half only
  EXPECT_EQ(hint_at(united, 1), (VisibilityHint{0, 0}));
  EXPECT_EQ(hint_at(united, 2), (VisibilityHint{6, 50}));
  EXPECT_EQ(united_hints(whole, {highs, high}, {lows, low}), united);
  EXPECT_EQ(hint_at(united_hints(whole, {lows, {}}, {highs, high}), 0), (VisibilityHint{128, 255}));
}

TEST(HintsFile, rows_come_back_and_damage_is_refused_at_every_length) {
  const std::string path = testing::TempDir() + "hints_test.hints";
  Digest store;
  store.bytes.fill(7);
  const HintBytes row = pack_hints(std::vector<VisibilityHint>{{1, 2}, {3, 4}, {5, 6}});
  {
    auto writer = HintsWriter::create(path, 12).value();
    ASSERT_TRUE(writer->add({}).ok());
    ASSERT_TRUE(writer->add(row).ok());
    ASSERT_TRUE(writer->add(unknown_hints(1)).ok());
    ASSERT_TRUE(writer->finish(store).ok());
  }
  const HintsReader reader = HintsReader::open(path).value();
  EXPECT_EQ(reader.store(), store);
  EXPECT_EQ(reader.viewpoints(), 12u);
  ASSERT_EQ(reader.node_count(), 3u);
  EXPECT_TRUE(reader.row(0).empty());
  EXPECT_EQ(HintBytes(reader.row(1).begin(), reader.row(1).end()), row);
  EXPECT_EQ(hint_at(reader.row(2), 0), kUnknownHint);

  const std::string bytes = read_file(path).value();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    ASSERT_TRUE(write_file(path, bytes.substr(0, size)).ok());
    EXPECT_FALSE(HintsReader::open(path).ok()) << size;
    std::string flipped = bytes;
    flipped[size] ^= 4;
    ASSERT_TRUE(write_file(path, flipped).ok());
    EXPECT_FALSE(HintsReader::open(path).ok()) << size;
  }
}

}  // namespace pvsfarm

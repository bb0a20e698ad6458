#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "common/pvs/visible_set.hpp"

namespace pvsfarm {

TEST(VisibleSet, encoding_gives_back_every_set) {
  EXPECT_TRUE(rc::check("decode(encode(s)) == s", [](const std::vector<std::uint16_t>& gone) {
    const auto universe = *rc::gen::inRange<std::uint32_t>(1, 700);
    VisibleSet set = VisibleSet::all(universe);
    for (const auto i : gone)
      set.remove_range(i % universe, std::min(universe - i % universe, i % 70u));
    const auto back = decode_visible_set(encode(set), 1000);
    RC_ASSERT(back.ok());
    RC_ASSERT(*back == set);
  }));
}

TEST(VisibleSet, a_truncated_or_padded_encoding_is_refused_or_another_set) {
  VisibleSet set = VisibleSet::all(500);
  set.remove_range(3, 200);
  const auto bytes = encode(set);
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    const auto back = decode_visible_set(std::span(bytes).first(n), 1000);
    EXPECT_FALSE(back.ok() && *back == set);
  }
  auto padded = bytes;
  padded.push_back(std::byte{0});
  EXPECT_FALSE(decode_visible_set(padded, 1000).ok());
  EXPECT_FALSE(decode_visible_set(bytes, 499).ok());
}

TEST(VisibleSet, ranges_and_counts_agree_with_single_objects) {
  VisibleSet set = VisibleSet::all(130);
  set.remove_range(60, 10);
  EXPECT_EQ(set.count(), 120u);
  EXPECT_FALSE(set.any_in(60, 10));
  EXPECT_TRUE(set.any_in(60, 11));
  EXPECT_FALSE(set.contains(ObjectId{64}));
  VisibleSet rest = VisibleSet::all(130);
  rest.remove_all(set);
  EXPECT_EQ(rest.count(), 10u);
  EXPECT_FALSE(rest.subset_of(set));
}

}  // namespace pvsfarm

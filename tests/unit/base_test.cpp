#include <gtest/gtest.h>

#include "common/base/digest.hpp"
#include "common/base/ids.hpp"
#include "common/base/result.hpp"

namespace pvsfarm {

TEST(Digest, of_nothing_is_the_published_value) {
  EXPECT_EQ(digest_of({}).hex(),
            "0e5751c026e543b2e8ab2eb06099daa1d1e5df47778f7787faab45cdf12fe3a8");
}

TEST(CellKey, parents_come_before_children_and_low_before_high) {
  const CellKey root{3, 1};
  EXPECT_LT((CellKey{2, 7}), root);
  EXPECT_LT(root, root.child(0));
  EXPECT_LT(root.child(0), root.child(0).child(1));
  EXPECT_LT(root.child(0).child(1), root.child(1));
  EXPECT_EQ(root.child(1).parent(), root);
  EXPECT_EQ(root.child(1).child(0).depth(), 2);
}

TEST(Result, carries_a_value_or_one_line) {
  const Result<int> good = 7;
  const Result<int> bad = invalid_input("a.obj: no faces");
  EXPECT_EQ(*good, 7);
  EXPECT_EQ(bad.error().kind, ErrorKind::kInvalidInput);
}

}  // namespace pvsfarm

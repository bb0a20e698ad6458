// Two workers bring different results of a cell: a third run decides, and until it has, what any of
// them shows is visible.
#include <gtest/gtest.h>

#include "coordinator/merger/merger.hpp"
#include "coordinator/service/bake_work.hpp"
#include "tests/support/farm_simulation.hpp"

namespace pvsfarm {
namespace {

const SimulatedWorld kWorld{.roots = 4};
const CellKey kRoot{1, 1};
constexpr WorkerId kAnn{1}, kBob{2}, kCat{3};

class DisputesTest : public testing::Test {
 protected:
  // As that worker would bring it. `shift`: 0 for the truth, else what is hidden in its place.
  WorkAnswer bring(WorkerId worker, const CellKey& key, int shift = 0, std::uint64_t lease = 0) {
    CellDelta delta = kWorld.evaluate(key, set_of(key));
    if (shift != 0) {
      --delta.point_triangles;
      delta.hidden = VisibleSet::none(kWorld.objects);
      delta.seen = delta.hidden;
      VisibleSet all = set_of(key), wrong = all;
      for (int i = 0; i < shift; ++i) wrong.remove(ObjectId{static_cast<std::uint32_t>(i)});
      delta.hidden = all;
      delta.hidden.remove_all(wrong);
    }
    return bring(worker, row_of(delta), lease);
  }
  WorkAnswer bring(WorkerId worker, const ResultRow& row, std::uint64_t lease = 0) {
    WorkResult result{.worker = "w", .id = worker};
    result.lease = LeaseId{lease != 0 ? lease : ++leases_};
    ResultBegin begin{.lease = result.lease};
    begin.deltas.push_back(
        {row.key, row.hidden.size(), row.seen.size(), row.point_triangles, row.statistics});
    result.head = begin;
    for (const Bytes& set : {row.hidden, row.seen})
      result.data.insert(result.data.end(), set.begin(), set.end());
    WorkAnswer answer;
    status_ = work_.accept(result, answer);
    return answer;
  }
  // What its task starts from.
  VisibleSet set_of(const CellKey& key) {
    if (sets_.count(key) == 0) sets_[key] = tree_.decoded_parent(key);
    return sets_.at(key);
  }
  CellDelta delta_of(const CellKey& key) {
    return decode_row(log_.read(key).value().value(), kWorld.objects).value();
  }
  bool is_true(const CellKey& key) {
    return delta_digest(log_.read(key).value().value()) ==
           delta_digest(row_of(kWorld.evaluate(key, set_of(key))));
  }

  Tree tree_ = kWorld.tree();
  ForgetfulLog log_;
  BakeWork work_{tree_, log_, {}};
  std::map<CellKey, VisibleSet> sets_;
  std::uint64_t leases_ = 0;
  Status status_;
};

TEST_F(DisputesTest, a_second_result_that_differs_is_run_once_more_by_a_third_worker) {
  bring(kAnn, kRoot);
  const WorkAnswer answer = bring(kBob, kRoot, 3);
  EXPECT_EQ(answer.outcome, ResultOutcome::kMismatch);
  ASSERT_EQ(answer.again.size(), 1u);
  EXPECT_EQ(answer.again[0].key, kRoot);
  EXPECT_EQ(answer.again[0].avoid, (std::vector{kAnn, kBob}));
  ASSERT_EQ(answer.warnings.size(), 1u);
  EXPECT_EQ(work_.disagreements(), 1u);
}

TEST_F(DisputesTest, until_the_third_run_only_what_both_hide_is_hidden) {
  bring(kAnn, kRoot);
  const VisibleSet first = delta_of(kRoot).hidden;
  bring(kBob, kRoot, 3);
  VisibleSet both = first;
  for (std::uint32_t i = 3; i < kWorld.objects; ++i) both.remove(ObjectId{i});
  EXPECT_EQ(delta_of(kRoot).hidden, both);
  EXPECT_TRUE(delta_of(kRoot).seen.count() == 0);
}

TEST_F(DisputesTest, the_first_result_stands_if_the_third_run_agrees_with_it) {
  bring(kAnn, kRoot);
  bring(kBob, kRoot, 3);
  const WorkAnswer answer = bring(kCat, kRoot);
  EXPECT_TRUE(is_true(kRoot));
  EXPECT_EQ(answer.checked, std::vector{kRoot});
  ASSERT_EQ(answer.wrong.size(), 1u);
  EXPECT_EQ(answer.wrong[0].worker, kBob);
}

TEST_F(DisputesTest, a_first_result_that_two_contradict_hides_no_more_than_they_do) {
  bring(kAnn, kRoot, 3);
  bring(kBob, kRoot);
  const WorkAnswer answer = bring(kCat, kRoot);
  ASSERT_EQ(answer.wrong.size(), 1u);
  EXPECT_EQ(answer.wrong[0].worker, kAnn);
  const CellDelta truth = kWorld.evaluate(kRoot, set_of(kRoot)), kept = delta_of(kRoot);
  EXPECT_TRUE(kept.hidden.subset_of(truth.hidden));
  EXPECT_EQ(kept.seen, truth.seen);
  EXPECT_EQ(kept.point_triangles, truth.point_triangles - 1);  // what rather splits of the two
}

TEST_F(DisputesTest, three_different_results_decide_nothing_and_show_what_any_shows) {
  bring(kAnn, kRoot, 5);
  bring(kBob, kRoot, 3);
  const WorkAnswer answer = bring(kCat, kRoot, 2);
  EXPECT_TRUE(answer.wrong.empty());
  EXPECT_EQ(answer.checked, std::vector{kRoot});
  EXPECT_EQ(delta_of(kRoot).hidden.count(), 2u);
  EXPECT_EQ(work_.disputes().figures().undecided, 1u);
}

TEST_F(DisputesTest, whoever_repeats_itself_has_one_voice) {
  bring(kAnn, kRoot);
  bring(kBob, kRoot, 3, 100);
  EXPECT_TRUE(bring(kBob, kRoot, 3, 100).checked.empty());  // told again: no run of its own
  EXPECT_EQ(work_.disputes().figures().undecided, 0u);
  EXPECT_FALSE(bring(kBob, kRoot, 3, 101).checked.empty());  // there was no other worker
  EXPECT_EQ(work_.disputes().figures().undecided, 1u);
  const VisibleSet truth = kWorld.evaluate(kRoot, set_of(kRoot)).hidden;
  EXPECT_TRUE(delta_of(kRoot).hidden.subset_of(truth));
}

TEST_F(DisputesTest, whoever_contradicts_itself_is_wrong_about_one) {
  bring(kAnn, kRoot);
  bring(kBob, kRoot, 3);
  const WorkAnswer answer = bring(kBob, kRoot);
  EXPECT_TRUE(is_true(kRoot));
  ASSERT_EQ(answer.wrong.size(), 1u);
  EXPECT_EQ(answer.wrong[0].worker, kBob);
}

TEST_F(DisputesTest, a_third_run_starts_from_what_the_first_started_from) {
  bring(kAnn, kRoot);
  const CellKey half = kRoot.child(1);
  ASSERT_TRUE(tree_.is_open(half));
  const VisibleSet before = set_of(half);
  bring(kAnn, half);
  bring(kBob, half, 3);
  SetShelf shelf;
  const auto task = work_.task({.lease = BoardLease{77}, .cells = {half}}, shelf);
  const Task& message = std::get<Task>(task.value());
  ASSERT_EQ(message.parents.size(), 1u);
  EXPECT_EQ(message.parents[0].set, encode(before));
  // Its parent's row says less now: those below it had the old one.
  bring(kBob, kRoot, 2);
  ASSERT_NE(encode(delta_of(kRoot).hidden),
            encode(kWorld.evaluate(kRoot, tree_.occludees()).hidden));
  const CellKey other = kRoot.child(0);
  bring(kAnn, other);
  bring(kBob, other, 4);
  const auto later = work_.task({.lease = BoardLease{78}, .cells = {other}}, shelf);
  EXPECT_EQ(std::get<Task>(later.value()).parents[0].set, encode(before));
}

TEST_F(DisputesTest, a_third_result_that_fits_no_such_cell_is_its_workers_fault) {
  bring(kAnn, kRoot);
  bring(kAnn, kRoot.child(0));
  bring(kBob, kRoot.child(0), 3);
  ResultRow row = row_of(kWorld.evaluate(kRoot.child(0), set_of(kRoot.child(0))));
  row.hidden = encode(tree_.occludees());  // more than its parent holds
  bring(kCat, row);
  ASSERT_FALSE(status_.ok());
  EXPECT_EQ(status_.error().kind, ErrorKind::kInvalidInput);
  bring(WorkerId{4}, kRoot.child(0));
  EXPECT_TRUE(is_true(kRoot.child(0)));
}

TEST_F(DisputesTest, without_a_third_run_the_doubt_stays) {
  bring(kAnn, kRoot);
  bring(kBob, kRoot, 3);
  EXPECT_NE(work_.give_up(kRoot).find("no third run"), std::string::npos);
  EXPECT_EQ(work_.progress(Millis(1)).given_up_count, 0u);
  EXPECT_LE(delta_of(kRoot).hidden.count(), 3u);
}

}  // namespace
}  // namespace pvsfarm

// A lease is one worker's: a result under another's, or under one that was never given, counts for
// nothing, and whoever brings it is turned out. What a coordinator before this one leased is
// taken: only that one knew whose it was.
#include <gtest/gtest.h>

#include "coordinator/service/bake_work.hpp"
#include "coordinator/service/desk.hpp"
#include "tests/support/farm_simulation.hpp"
#include "tests/support/fault_figures.hpp"

namespace pvsfarm {
namespace {

using namespace std::chrono_literals;

const SimulatedWorld kWorld{.roots = 30};

class ForeignResultsTest : public testing::Test {
 protected:
  void start(std::uint64_t epoch) {
    epoch_ = epoch;
    tree_ = std::make_unique<Tree>(kWorld.tree());
    log_ = ForgetfulLog();
    work_ = std::make_unique<BakeWork>(*tree_, log_, Estimate());
    desk_ = std::make_unique<Desk>(DeskSettings{.epoch = epoch}, *work_, now_);
  }
  // Says HELLO and, if it is ready, gets its first task.
  void join(const std::string& peer, std::uint8_t uuid, bool ready) {
    Hello hello;
    hello.worker[0] = uuid;
    tell(peer, hello);
    if (ready) tell(peer, Heartbeat{.ready = true});
  }
  void tell(const std::string& peer, Message message) {
    const Envelope envelope{.session = sessions_[peer], .epoch = epoch_};
    ASSERT_TRUE(
        desk_->receive(peer, Decoded{.envelope = envelope, .message = std::move(message)}, now_)
            .ok());
    now_ += 1ms;
    ASSERT_TRUE(desk_->tick(now_).ok());
    for (Outgoing& out : desk_->take_outgoing()) {
      if (std::holds_alternative<Welcome>(out.message)) sessions_[out.peer] = out.envelope.session;
      if (const auto* task = std::get_if<Task>(&out.message)) tasks_[out.peer].push_back(*task);
      if (const auto* reject = std::get_if<Reject>(&out.message))
        rejects_.try_emplace(out.peer, *reject);  // the first
      if (const auto* ack = std::get_if<ResultAck>(&out.message)) acks_[out.peer] = *ack;
    }
  }
  // The true result of a cell, under that lease.
  void bring(const std::string& peer, LeaseId lease, const CellKey& key) {
    const ResultRow row = row_of(kWorld.evaluate(key, VisibleSet::all(kWorld.objects)));
    ResultBegin begin{.lease = lease, .bytes = row.hidden.size() + row.seen.size()};
    begin.deltas.push_back(
        {row.key, row.hidden.size(), row.seen.size(), row.point_triangles, row.statistics});
    Bytes data = row.hidden;
    data.insert(data.end(), row.seen.begin(), row.seen.end());
    tell(peer, begin);
    tell(peer, ResultChunk{lease, 0, data});
    tell(peer, ResultEnd{lease, digest_of(data)});
    now_ += 25ms;
    tell(peer, StatusGet{});  // time for a commit
  }

  Millis now_{0};
  std::uint64_t epoch_ = 0;
  std::unique_ptr<Tree> tree_;
  ForgetfulLog log_;
  std::unique_ptr<BakeWork> work_;
  std::unique_ptr<Desk> desk_;
  std::map<std::string, std::uint64_t> sessions_;
  std::map<std::string, std::vector<Task>> tasks_;
  std::map<std::string, Reject> rejects_;
  std::map<std::string, ResultAck> acks_;
};

}  // namespace

TEST_F(ForeignResultsTest, under_anothers_lease_are_refused_a_thousand_times) {
  int accepted = 0, turned_out = 0;
  const int tries = 1000;
  start(7);
  join("owner", 1, true);
  const Task task = tasks_["owner"].at(0);
  for (int i = 0; i < tries; ++i) {
    const std::string peer = "stranger" + std::to_string(i);
    join(peer, static_cast<std::uint8_t>(2 + i % 200), false);
    const auto lease = static_cast<std::uint64_t>(task.lease);
    // The lease itself, others of this coordinator that nobody has, and a cell of one's own choice.
    const LeaseId claimed{i % 2 == 0 ? lease : lease + 10 + static_cast<std::uint64_t>(i)};
    bring(peer, claimed, i % 4 < 2 ? task.cells[0].key : CellKey{20, 1});
    accepted += acks_.count(peer) != 0 && acks_[peer].outcome == ResultOutcome::kMerged ? 1 : 0;
    turned_out += rejects_.count(peer) != 0 && rejects_[peer].code == RejectCode::kForbidden;
  }
  accepted += static_cast<int>(log_.committed.size() + log_.waiting.size());
  EXPECT_EQ(accepted, 0);
  EXPECT_EQ(turned_out, tries);
  bring("owner", task.lease, task.cells[0].key);
  EXPECT_EQ(log_.committed.size(), 1u);
  record({.row = 19,
          .what = "results under another worker's lease, or one that nobody has, accepted, of " +
                  std::to_string(tries) + " tries",
          .asked = "0",
          .reached = std::to_string(accepted),
          .held = accepted == 0});
}

TEST_F(ForeignResultsTest, of_a_lease_that_is_over_are_still_its_workers) {
  start(7);
  join("owner", 1, true);
  const Task task = tasks_["owner"].at(0);
  now_ += 100s;  // its lease ran out, its connection was given up
  join("other", 2, false);
  join("owner", 1, false);
  bring("other", task.lease, task.cells[0].key);
  EXPECT_EQ(rejects_["other"].code, RejectCode::kForbidden);
  EXPECT_TRUE(log_.committed.empty());
  bring("owner", task.lease, task.cells[0].key);
  EXPECT_EQ(acks_["owner"].outcome, ResultOutcome::kMerged);
}

TEST_F(ForeignResultsTest, of_a_coordinator_before_are_taken_from_whoever_has_them) {
  start(6);
  join("owner", 1, true);
  const Task task = tasks_["owner"].at(0);
  start(7);
  join("owner", 1, false);
  bring("owner", task.lease, task.cells[0].key);
  EXPECT_EQ(acks_["owner"].outcome, ResultOutcome::kMerged);
  EXPECT_EQ(log_.committed.size(), 1u);
}

// Unless one of them has told that it is at it.
TEST_F(ForeignResultsTest, of_a_coordinator_before_are_refused_where_another_holds_the_lease) {
  start(6);
  join("owner", 1, true);
  const Task task = tasks_["owner"].at(0);
  start(7);
  join("owner", 1, false);
  Heartbeat beat;
  beat.running.push_back({task.lease, 1, {task.cells[0].key}});
  tell("owner", beat);
  join("other", 2, false);
  bring("other", task.lease, task.cells[0].key);
  EXPECT_EQ(rejects_["other"].code, RejectCode::kForbidden);
  EXPECT_TRUE(log_.committed.empty());
  bring("owner", task.lease, task.cells[0].key);
  EXPECT_EQ(log_.committed.size(), 1u);
}

TEST(LeaseOwners, forget_what_is_long_over_and_nothing_else) {
  const std::uint64_t first = 7ull << 32 | 1;
  LeaseOwners owners(first);
  using Claim = LeaseOwners::Claim;
  for (std::uint64_t i = 0; i < 100'000; ++i)
    owners.given(BoardLease{first + i}, WorkerId{1 + i % 3});
  EXPECT_EQ(owners.claim(BoardLease{first + 99'999}, WorkerId{1}), Claim::kOwn);
  EXPECT_EQ(owners.claim(BoardLease{first + 99'999}, WorkerId{2}), Claim::kAnothers);
  EXPECT_EQ(owners.claim(BoardLease{first + 100'000}, WorkerId{2}), Claim::kAnothers);
  EXPECT_EQ(owners.claim(BoardLease{first + 34'464}, WorkerId{1}), Claim::kOwn);
  EXPECT_EQ(owners.claim(BoardLease{first + 34'463}, WorkerId{3}), Claim::kForgotten);
  EXPECT_EQ(owners.claim(BoardLease{first - 1}, WorkerId{1}), Claim::kAnothers);
  EXPECT_EQ(owners.claim(BoardLease{6ull << 32 | 1}, WorkerId{1}), Claim::kOfOtherCoordinator);
}

}  // namespace pvsfarm

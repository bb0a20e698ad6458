// The task board under told time.
#include <gtest/gtest.h>

#include "coordinator/board/estimate.hpp"
#include "tests/unit/board_samples.hpp"

namespace pvsfarm {

TEST(Board, cells_are_leased_in_canonical_order_however_they_were_added) {
  Board board = board_of(3);
  board.add(root(1).child(0));
  board.join(kAnn, 2);
  std::vector<CellKey> order;
  for (int i = 0; i < 4; ++i) order.push_back(board.lease(kAnn, 0ms)->cells.at(0));
  EXPECT_EQ(order, (std::vector<CellKey>{root(0), root(1), root(1).child(0), root(2)}));
}

TEST(Board, a_bakes_first_cells_are_spread_over_all_of_them) {
  Board board = board_of(100, {.leases_per_slot = 1000, .order = TaskOrder::spread(100)});
  board.add(root(64).child(1));
  board.join(kAnn, 1);
  std::vector<CellKey> order;
  while (const auto task = board.lease(kAnn, 0ms)) order.push_back(task->cells.at(0));
  ASSERT_EQ(order.size(), 101u);
  EXPECT_EQ(std::vector(order.begin(), order.begin() + 5),
            (std::vector<CellKey>{root(0), root(64), root(64).child(1), root(32), root(96)}));
  // Whichever part is done, as many are of the lower half as of the upper.
  int lower = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    lower += order[i].root < 50 ? 1 : 0;
    EXPECT_NEAR(lower, static_cast<double>(i + 1) / 2, 6) << i;
  }
}

TEST(Board, neighbours_of_very_many_roots_follow_each_other) {
  const TaskOrder order = TaskOrder::spread(1'000'000);
  EXPECT_EQ(order.run_roots, 245u);
  EXPECT_TRUE(order(root(0), root(1)));
  EXPECT_TRUE(order(root(244), root(1 << 18)));
  EXPECT_FALSE(order(root(500), root(500)));
}

TEST(Board, a_worker_holds_one_running_and_one_waiting_lease_a_slot) {
  Board board = board_of(10);
  board.join(kAnn, 1);
  EXPECT_TRUE(board.lease(kAnn, 0ms).has_value());
  EXPECT_TRUE(board.lease(kAnn, 0ms).has_value());
  EXPECT_FALSE(board.lease(kAnn, 0ms).has_value());
  EXPECT_FALSE(board.lease(kBob, 0ms).has_value());  // never joined
}

TEST(Board, tasks_grow_until_they_last) {
  Board board = board_of(1000, {.task_ms = 75});
  board.join(kAnn, 1);
  const BoardTask first = *board.lease(kAnn, 0ms);
  EXPECT_EQ(first.cells.size(), 1u);  // nothing is known yet
  board.complete(first.cells[0], 5);
  board.finish(first.lease);
  const BoardTask second = *board.lease(kAnn, 0ms);
  EXPECT_EQ(second.cells.size(), 15u);
  for (std::size_t i = 0; i < 15; ++i) EXPECT_EQ(second.cells[i].root, 1 + i);  // neighbours
}

TEST(Board, towards_the_end_the_rest_is_shared) {
  Board board = board_of(9);
  board.join(kAnn, 1);
  board.join(kBob, 1);
  const BoardTask first = *board.lease(kAnn, 0ms);
  board.complete(first.cells[0], 0.1);
  board.finish(first.lease);
  EXPECT_EQ(board.lease(kAnn, 0ms)->cells.size(), 3u);
  EXPECT_LE(board.lease(kBob, 0ms)->cells.size(), 3u);
}

TEST(Board, a_lease_without_progress_runs_out_and_its_cells_go_to_another) {
  Board board = board_of(1);
  board.join(kAnn, 1);
  board.join(kBob, 1);
  const BoardTask task = *board.lease(kAnn, 0ms);
  EXPECT_TRUE(board.renew(task.lease, 0, 29s));  // alive, but it does not advance
  EXPECT_TRUE(board.expire(29'999ms).empty());
  EXPECT_EQ(board.expire(30s), std::vector<BoardLease>{task.lease});
  EXPECT_FALSE(board.renew(task.lease, 1, 31s));
  const BoardTask again = *board.lease(kBob, 31s);
  EXPECT_EQ(again.cells, task.cells);
  EXPECT_EQ(again.attempt, 1u);
  board.complete(root(0), 1);
  EXPECT_TRUE(board.idle());
}

TEST(Board, progress_renews_a_lease_and_those_waiting_behind_it) {
  Board board = board_of(2, {.deadline = 1h});
  board.join(kAnn, 1);
  const BoardTask running = *board.lease(kAnn, 0ms), waiting = *board.lease(kAnn, 0ms);
  for (int s = 10; s <= 100; s += 10) {
    EXPECT_TRUE(board.renew(running.lease, static_cast<std::uint64_t>(s), s * 1s));
    EXPECT_TRUE(board.renew(waiting.lease, 0, s * 1s));
  }
  EXPECT_TRUE(board.expire(129s).empty());
  EXPECT_EQ(board.expire(130s), (std::vector<BoardLease>{running.lease, waiting.lease}));
}

TEST(Board, a_worker_stuck_with_a_lease_gets_no_more_than_before) {
  Board board = board_of(10);
  board.join(kAnn, 1);
  for (int i = 0; i < 2; ++i) board.lease(kAnn, 0ms);
  const std::vector<BoardLease> gone = board.expire(60s);
  EXPECT_FALSE(board.lease(kAnn, 60s).has_value());
  board.release_expired(kAnn, {gone.begin(), gone.end()});  // it still has them
  EXPECT_FALSE(board.lease(kAnn, 60s).has_value());
  board.release_expired(kAnn, {});
  EXPECT_TRUE(board.lease(kAnn, 60s).has_value());
}

TEST(Board, a_task_that_never_arrived_runs_out_though_its_worker_is_busy) {
  Board board = board_of(2, {.deadline = 1h});
  board.join(kAnn, 1);
  const BoardTask running = *board.lease(kAnn, 0ms), lost = *board.lease(kAnn, 0ms);
  for (int s = 10; s <= 100; s += 10)
    board.renew(running.lease, static_cast<std::uint64_t>(s), s * 1s);
  EXPECT_EQ(board.expire(100s), std::vector<BoardLease>{lost.lease});
}

TEST(Board, a_lost_worker_returns_its_cells_and_a_leaving_one_without_blame) {
  Board board = board_of(1);
  board.join(kAnn, 1);
  board.lease(kAnn, 0ms);
  board.leave(kAnn, Board::Parting::kGraceful);
  board.join(kBob, 1);
  const BoardTask second = *board.lease(kBob, 1ms);
  EXPECT_EQ(second.attempt, 0u);
  board.leave(kBob, Board::Parting::kLost);
  board.join(kAnn, 1);
  EXPECT_EQ(board.lease(kAnn, 2ms)->attempt, 1u);
}

TEST(Board, a_cell_that_failed_goes_alone) {
  Board board = board_of(100, {.task_ms = 75});
  board.join(kAnn, 1);
  const BoardTask first = *board.lease(kAnn, 0ms);
  board.complete(first.cells[0], 10);
  board.finish(first.lease);
  const BoardTask many = *board.lease(kAnn, 0ms);
  ASSERT_EQ(many.cells.size(), 8u);
  board.fail(many.lease, Board::Failure::kTransient);
  const BoardTask alone = *board.lease(kAnn, 0ms);
  EXPECT_EQ(alone.cells, std::vector<CellKey>{many.cells[0]});
}

TEST(Board, a_cell_lost_too_often_is_given_up) {
  Board board = board_of(1);
  for (int i = 0; i < 11; ++i) {
    EXPECT_TRUE(board.take_given_up().empty()) << i;
    board.join(kAnn, 1);
    ASSERT_TRUE(board.lease(kAnn, i * 10s).has_value()) << i;
    board.leave(kAnn, Board::Parting::kLost, i * 10s);
  }
  EXPECT_EQ(board.take_given_up(), std::vector<CellKey>{root(0)});
  EXPECT_TRUE(board.idle());
}

TEST(Board, a_cell_that_fails_for_a_reason_on_three_workers_is_given_up) {
  Board board = board_of(1);
  for (const WorkerId worker : {kAnn, kBob, kCid}) {
    EXPECT_TRUE(board.take_given_up().empty());
    board.join(worker, 1);
  }
  for (const WorkerId worker : {kAnn, kBob, kCid}) {
    const BoardTask task = *board.lease(worker, 10s);
    board.fail(task.lease, Board::Failure::kDeterministic, 10s);
    EXPECT_FALSE(board.lease(worker, 20s).has_value());  // others may do better
  }
  EXPECT_EQ(board.take_given_up(), std::vector<CellKey>{root(0)});
}

TEST(Board, slow_cells_make_leases_longer) {
  Board board = board_of(2);
  board.join(kAnn, 1);
  const BoardTask first = *board.lease(kAnn, 0ms);
  board.complete(first.cells[0], 16'000);  // told as its bucket's edge
  board.finish(first.lease);
  const BoardTask second = *board.lease(kAnn, 0ms);
  // Without a word for 30 s, whatever cells cost; without progress for 4 steps.
  EXPECT_EQ(board.next_expiry(), std::optional<Millis>(30s));
  for (int s = 10; s <= 60; s += 10) board.renew(second.lease, 1, s * 1s);
  EXPECT_EQ(board.next_expiry(), std::optional<Millis>(10s + 4 * 16'384ms));
}

TEST(Board, a_lease_ends_at_its_deadline_however_much_it_advances) {
  Board board = board_of(1);
  board.join(kAnn, 1);
  const BoardTask task = *board.lease(kAnn, 0ms);
  std::vector<BoardLease> gone;
  int s = 0;
  for (; gone.empty() && s < 100; s += 2) {
    board.renew(task.lease, static_cast<std::uint64_t>(s + 1), s * 1s);
    gone = board.expire(s * 1s + 1s);
  }
  EXPECT_EQ(gone, std::vector<BoardLease>{task.lease});
  EXPECT_EQ(s, 62);
}

TEST(Board, each_attempt_has_twice_the_time) {
  Board board = board_of(1);
  board.join(kAnn, 1);
  board.join(kBob, 1);
  const BoardTask task = *board.lease(kAnn, 0ms);
  for (int s = 2; s < 30; s += 2) board.renew(task.lease, 1, s * 1s);
  board.expire(32s);
  const BoardTask again = *board.lease(kBob, 32s);
  for (int s = 33; s < 92; s += 2) board.renew(again.lease, 0, s * 1s);
  EXPECT_TRUE(board.expire(91s).empty());
  EXPECT_FALSE(board.expire(92s).empty());
}

TEST(Board, what_waited_at_a_lost_worker_is_not_blamed) {
  Board board = board_of(2);
  board.join(kAnn, 1);
  const BoardTask ran = *board.lease(kAnn, 0ms), waited = *board.lease(kAnn, 0ms);
  board.leave(kAnn, Board::Parting::kLost);
  board.join(kBob, 1);
  const BoardTask retry = *board.lease(kBob, 0ms);
  EXPECT_EQ(retry.cells, ran.cells);
  EXPECT_EQ(retry.attempt, 1u);
  EXPECT_FALSE(board.lease(kBob, 0ms).has_value());  // on trial: alone at its worker
  board.complete(ran.cells[0], 1);
  board.finish(retry.lease);
  EXPECT_EQ(board.lease(kBob, 0ms)->attempt, 0u);
  EXPECT_EQ(board.leased_count(), 1u);
  EXPECT_EQ(waited.cells.size(), 1u);
}

TEST(Board, a_retry_pauses_and_does_not_hold_up_the_rest) {
  Board board = board_of(3);
  board.join(kAnn, 1);
  for (int i = 0; i < 2; ++i)
    board.fail(board.lease(kAnn, 0ms)->lease, Board::Failure::kTransient, 0ms);
  const BoardTask other = *board.lease(kAnn, 249ms);
  EXPECT_EQ(other.cells[0], root(1));
  board.complete(root(1), 1);
  board.finish(other.lease);
  const BoardTask again = *board.lease(kAnn, 250ms);
  EXPECT_EQ(again.cells[0], root(0));
  EXPECT_EQ(again.attempt, 2u);
}

TEST(StepTimes, quantiles_are_told_to_one_part_in_eight_and_never_too_small) {
  StepTimes times;
  EXPECT_EQ(times.quantile(0.95).count(), 0);
  for (int ms = 1; ms <= 1000; ++ms) times.add(ms);
  for (const double q : {0.1, 0.5, 0.95, 1.0}) {
    const auto told = static_cast<double>(times.quantile(q).count());
    EXPECT_GE(told, q * 1000);
    EXPECT_LE(told, q * 1000 * 1.125 + 1);
  }
  times.add(1e300);
  times.add(0);
  EXPECT_GT(times.quantile(1).count(), 1'000'000);
}

TEST(Board, a_result_that_misses_a_cell_gives_it_back) {
  Board board = board_of(1);
  board.join(kAnn, 1);
  const BoardTask task = *board.lease(kAnn, 0ms);
  board.finish(task.lease);
  EXPECT_EQ(board.pending_count(), 1u);
  EXPECT_FALSE(board.holds(task.lease));
}

TEST(Estimate, a_steady_farm_is_told_right) {
  Estimate estimate;
  for (int i = 0; i < 1000; ++i) estimate.opened(0);
  estimate.at(0ms);
  ProgressFigures figures;
  for (int i = 0; i < 200; ++i) {  // 20 cells a second
    estimate.done({.depth = 0, .cost_ms = 100});
    figures = estimate.at(50ms * (i + 1));
  }
  EXPECT_EQ(figures.cells_done, 200u);
  EXPECT_EQ(figures.cells_open, 800u);
  EXPECT_NEAR(figures.cells_per_second, 20, 0.5);
  EXPECT_NEAR(figures.eta_s, 40, 1);
}

TEST(Estimate, splitting_to_come_is_counted) {
  // Every root splits and no child does: three cells a root. After 50 of 100 roots with their
  // children, a naive estimate would see 50 open cells; 150 are to come.
  Estimate estimate;
  for (int i = 0; i < 100; ++i) estimate.opened(0);
  Millis now{0};
  estimate.at(now);
  for (int i = 0; i < 50; ++i) {
    estimate.opened(1);
    estimate.opened(1);
    estimate.done({.depth = 0, .cost_ms = 100, .split = true});
    estimate.done({.depth = 1, .cost_ms = 100});
    estimate.done({.depth = 1, .cost_ms = 100});
    now += 300ms;
    estimate.at(now);
  }
  const ProgressFigures figures = estimate.at(now);
  EXPECT_NEAR(figures.cells_expected, 300, 15);
  EXPECT_NEAR(figures.eta_s, 15, 1.5);
}

TEST(Estimate, what_the_journal_gave_back_is_no_speed) {
  Estimate estimate;
  for (int i = 0; i < 10; ++i) estimate.opened(0);
  for (int i = 0; i < 5; ++i) estimate.done({.depth = 0, .cost_ms = 10, .live = false});
  estimate.at(0ms);
  const ProgressFigures figures = estimate.at(10s);
  EXPECT_EQ(figures.cells_done, 5u);
  EXPECT_EQ(figures.cells_per_second, 0);
  EXPECT_LT(figures.eta_s, 0);
}

}  // namespace pvsfarm

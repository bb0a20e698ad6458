// Stragglers, copies, and who is to blame: the task board under told time.
#include <gtest/gtest.h>

#include "tests/unit/board_samples.hpp"

namespace pvsfarm {

TEST(Board, a_straggler_is_copied_once_when_nothing_is_pending) {
  Board board = board_of(4);
  board.join(kAnn, 1);
  board.join(kBob, 1);
  board.join(kCid, 1);
  const BoardTask slow = *board.lease(kAnn, 0ms);
  for (int i = 1; i <= 3; ++i) {
    const BoardTask task = *board.lease(kBob, Millis(i * 1000));
    EXPECT_EQ(task.cells.size(), 1u);
    board.complete(task.cells[0], 1000);
    board.finish(task.lease, Millis(i * 1000 + 1000));
  }
  EXPECT_FALSE(board.lease(kCid, 2s).has_value());  // not late yet
  const BoardTask copy = *board.lease(kBob, 4s);
  EXPECT_EQ(copy.cells, slow.cells);
  EXPECT_FALSE(board.lease(kCid, 60s).has_value());  // one copy
  board.complete(slow.cells[0], 1000);
  board.finish(copy.lease, 5s);
  EXPECT_EQ(board.take_superseded(), std::vector<BoardLease>{slow.lease});
  EXPECT_TRUE(board.idle());
  EXPECT_EQ(board.lease_count(kAnn), 1u);  // still busy with it
  board.release_expired(kAnn, {});
  EXPECT_EQ(board.lease_count(kAnn), 0u);
}

TEST(Board, a_copy_that_fails_leaves_the_cell_to_the_first_and_the_other_way_round) {
  for (const bool first_fails : {false, true}) {
    Board board = board_of(2);
    board.join(kAnn, 1);
    board.join(kBob, 1);
    const BoardTask slow = *board.lease(kAnn, 0ms), fast = *board.lease(kBob, 0ms);
    board.complete(fast.cells[0], 100);
    board.finish(fast.lease, 100ms);
    const BoardTask copy = *board.lease(kBob, 10s);
    board.fail(first_fails ? slow.lease : copy.lease, Board::Failure::kTransient, 11s);
    EXPECT_EQ(board.pending_count(), 0u);
    EXPECT_EQ(board.leased_count(), 1u);
    board.fail(first_fails ? copy.lease : slow.lease, Board::Failure::kTransient, 11s);
    EXPECT_EQ(board.pending_count(), 1u);
    EXPECT_EQ(board.leased_count(), 0u);
  }
}

TEST(Board, what_waits_behind_a_straggler_is_moved) {
  Board board = board_of(3);
  board.join(kAnn, 1);
  board.join(kBob, 1);
  const BoardTask runs = *board.lease(kAnn, 0ms), waits = *board.lease(kAnn, 0ms);
  const BoardTask fast = *board.lease(kBob, 0ms);
  board.complete(fast.cells[0], 100);
  board.finish(fast.lease, 100ms);
  const BoardTask copied = *board.lease(kBob, 10s);
  EXPECT_EQ(copied.cells, runs.cells);
  board.complete(runs.cells[0], 100);
  board.finish(copied.lease, 11s);
  EXPECT_EQ(board.take_superseded(), std::vector<BoardLease>{runs.lease});
  const BoardTask moved = *board.lease(kBob, 11s);
  EXPECT_EQ(moved.cells, waits.cells);
  EXPECT_EQ(board.take_superseded(), std::vector<BoardLease>{waits.lease});
  EXPECT_FALSE(board.renew(waits.lease, 0, 12s));
  EXPECT_EQ(board.copies(), 1u);
}

TEST(Board, a_worker_that_names_what_it_computes_keeps_it) {
  Board board = board_of(3);
  board.join(kAnn, 1);
  EXPECT_TRUE(board.adopt(kAnn, BoardLease{1ull << 40}, {root(0), root(7)}, 0ms));
  EXPECT_FALSE(board.adopt(kAnn, BoardLease{2ull << 40}, {root(8)}, 0ms));
  EXPECT_EQ(board.pending_count(), 2u);
  EXPECT_TRUE(board.renew(BoardLease{1ull << 40}, 5, 29s));
  EXPECT_TRUE(board.expire(58s).empty());
  EXPECT_FALSE(board.expire(59s).empty());
  EXPECT_EQ(board.pending_count(), 3u);
}

namespace {
// One more cell of `board` fails on a worker.
CellKey fail_on(Board& board, WorkerId worker, Millis now) {
  const BoardTask task = *board.lease(worker, now);
  EXPECT_EQ(task.cells.size(), 1u);
  board.fail(task.lease, Board::Failure::kDeterministic, now);
  return task.cells[0];
}
}  // namespace

TEST(Board, a_worker_that_never_did_well_is_blocked_after_three_cells) {
  Board board = board_of(9);
  board.join(kAnn, 1);
  board.join(kBob, 1);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(board.take_blocked().empty());
    fail_on(board, kAnn, 0ms);
  }
  const std::vector<Board::Blocked> blocked = board.take_blocked();
  ASSERT_EQ(blocked.size(), 1u);
  EXPECT_EQ(blocked[0].worker, kAnn);
  EXPECT_EQ(blocked[0].cells, 3u);
}

TEST(Board, a_worker_is_blocked_for_cells_that_others_complete_and_not_for_poison_ones) {
  for (const bool poison : {false, true}) {
    Board board = board_of(9);
    for (const WorkerId worker : {kAnn, kBob, kCid}) {
      board.join(worker, 1);
      board.did_well(worker);
    }
    std::vector<CellKey> failed;
    for (int i = 0; i < 3; ++i) failed.push_back(fail_on(board, kAnn, 0ms));
    EXPECT_TRUE(board.take_blocked().empty());  // it did well before
    for (int i = 0; i < 3; ++i) {
      if (poison) {
        EXPECT_EQ(fail_on(board, kBob, 1s), failed[static_cast<std::size_t>(i)]);
        EXPECT_EQ(fail_on(board, kCid, 1s), failed[static_cast<std::size_t>(i)]);
      } else {
        const BoardTask task = *board.lease(kBob, 1s);
        board.complete(task.cells[0], 1);
        board.finish(task.lease, 1s);
      }
    }
    EXPECT_EQ(board.take_blocked().size(), poison ? 0u : 1u);
    EXPECT_EQ(board.take_given_up().size(), poison ? 3u : 0u);
  }
}

TEST(Board, a_machine_whose_workers_crash_one_after_the_other_is_blocked) {
  Board board = board_of(20, {.leases_per_slot = 1, .conduct = {.crash_loop = 3}});
  for (std::uint64_t i = 201; i <= 203; ++i) {
    EXPECT_TRUE(board.take_blocked().empty());
    board.join(WorkerId{i}, 1, MachineId{7});
    const BoardTask task = *board.lease(WorkerId{i}, 0ms);
    board.leave(WorkerId{i}, Board::Parting::kLost);
    board.complete(task.cells[0], 1);
  }
  const std::vector<Board::Blocked> blocked = board.take_blocked();
  ASSERT_EQ(blocked.size(), 1u);
  EXPECT_FALSE(blocked[0].worker.has_value());
  EXPECT_EQ(blocked[0].machine, MachineId{7});
}

TEST(Board, workers_lost_together_or_come_back_are_no_crash_loop) {
  Board board = board_of(40, {.leases_per_slot = 1, .conduct = {.crash_loop = 2}});
  for (int round = 0; round < 5; ++round) {
    for (std::uint64_t i = 1; i <= 4; ++i) board.join(WorkerId{i}, 1, MachineId{7});
    for (std::uint64_t i = 1; i <= 4; ++i) board.lease(WorkerId{i}, round * 60s);
    for (std::uint64_t i = 1; i <= 4; ++i)
      board.leave(WorkerId{i}, Board::Parting::kLost, round * 60s);
  }
  EXPECT_TRUE(board.take_blocked().empty());
}

TEST(Board, a_cell_that_never_finds_memory_is_given_up_after_five_times_alone) {
  Board board = board_of(1);
  board.join(kAnn, 1);
  for (int i = 0; i < 5; ++i) {
    EXPECT_TRUE(board.take_given_up().empty()) << i;
    const auto task = board.lease(kAnn, i * 60s);
    ASSERT_TRUE(task.has_value());
    board.fail(task->lease, Board::Failure::kResource, i * 60s);
  }
  EXPECT_EQ(board.take_given_up(), std::vector<CellKey>{root(0)});
  EXPECT_TRUE(board.take_blocked().empty());
}

TEST(Board, memory_that_was_short_with_others_beside_it_does_not_count_against_a_cell) {
  BoardLimits limits;
  limits.short_of_memory = 1;
  Board board = board_of(2, limits);
  board.join(kAnn, 1);
  ASSERT_TRUE(board.adopt(kAnn, BoardLease{77}, {root(0), root(1)}, 0ms));
  board.fail(BoardLease{77}, Board::Failure::kResource, 1s);
  EXPECT_TRUE(board.take_given_up().empty());
  EXPECT_EQ(board.pending_count(), 2u);
}

TEST(Board, a_cell_that_is_done_again_goes_to_another_worker) {
  Board board = board_of(0);
  board.join(kAnn, 1);
  board.join(kBob, 1);
  board.add_again(root(4), kAnn);
  EXPECT_FALSE(board.idle());
  EXPECT_FALSE(board.lease(kAnn, 0ms).has_value());
  EXPECT_EQ(board.lease(kBob, 0ms)->cells[0], root(4));
}

TEST(Board, a_cell_that_need_not_be_done_again_is_withdrawn_pending_or_leased) {
  Board board = board_of(0);
  board.join(kAnn, 1);
  board.join(kBob, 1);
  board.add_again(root(4), kAnn);
  board.withdraw(root(4));
  EXPECT_TRUE(board.idle());
  board.add_again(root(4), kAnn);
  const BoardTask task = *board.lease(kBob, 0ms);
  board.withdraw(root(4));
  EXPECT_TRUE(board.idle());
  EXPECT_EQ(board.take_superseded(), std::vector<BoardLease>{task.lease});
}

}  // namespace pvsfarm

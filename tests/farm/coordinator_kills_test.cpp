// A coordinator that is killed, at any time and at every point of a result's way to the disk, and
// started again: nothing that it acknowledged is asked for again, and the store is the same.
#include "common/base/random.hpp"
#include "tests/farm/durable_farm.hpp"
#include "tests/support/fault_figures.hpp"

namespace pvsfarm {
namespace {

constexpr unsigned kSlots = 2;

class CoordinatorKills : public DurableFarm {
 protected:
  void expect_nothing_lost(const WorkerFigures& figures) const {
    EXPECT_EQ(figures.forgotten, 0u);
    EXPECT_EQ(figures.mismatches, 0u);
  }
};

// The largest part of the work that one kill cost: a coordinator that starts anew makes its tasks
// anew, so it is counted in cells, and told in tasks as large as they come.
struct Redone {
  std::uint64_t cells = 0;
  double most_tasks = 0;
  void after_a_kill(const WorkerFigures& figures) {
    const std::uint64_t more = figures.cells_again - std::exchange(cells, figures.cells_again);
    if (more > 0)
      most_tasks = std::max(most_tasks,
                            static_cast<double>(more) / static_cast<double>(figures.largest_task));
  }
};

struct KillPoint {
  const char *name, *fault;
};
// In the order in which a bake comes by them.
constexpr KillPoint kPoints[] = {
    {"a journal that is half made", "write:journal.partial:1:half"},
    {"before the journal has its name", "rename:.journal:1:before"},
    {"once the journal has its name", "rename:.journal:1:after"},
    {"half of a commit written", "write:-wal:9:half"},
    {"a commit written, not synced", "sync:-wal:2:before"},
    {"a commit synced, not acknowledged", "sync:-wal:3:after"},
    {"another commit synced, not acknowledged", "sync:-wal:7:after"},
    {"half of the statistics", "write:.stats.partial:1:half"},
    {"half of the store", "write:city.pvs.partial:1:half"},
    {"the store written, not synced", "sync:city.pvs.partial:1:before"},
    {"the store synced, without its name", "sync:city.pvs.partial:1:after"},
    {"the store has its name, its folder is not synced", "rename:/city.pvs:2:after"},
    {"before the journal is removed", "unlink:.journal:1:before"},
    {"half of the journal removed", "unlink:.journal:1:after"},
};

}  // namespace

TEST_F(CoordinatorKills, at_every_named_point_nothing_acknowledged_is_lost) {
  InstantWorkers workers(endpoint(), work(0.2));
  int reached = 0;
  Redone redone;
  for (const KillPoint& point : kPoints) {
    SCOPED_TRACE(point.name);
    workers.connect_again();
    const auto coordinator = coordinate(point.fault);
    const int code = coordinator->wait(60);
    ASSERT_EQ(code, 128 + SIGKILL) << coordinator->err();
    ++reached;
    redone.after_a_kill(workers.figures());
    expect_nothing_lost(workers.figures());
  }
  workers.connect_again();
  const auto last = coordinate();
  ASSERT_EQ(last->wait(60), 0) << last->err();
  const bool same = golden();
  EXPECT_TRUE(same);
  const WorkerFigures figures = workers.figures();
  expect_nothing_lost(figures);
  EXPECT_LE(redone.most_tasks, 2 * kSlots);
  record({.row = 3,
          .what = "acknowledged cells lost at " + std::to_string(reached) + " named points",
          .asked = "0",
          .reached = std::to_string(figures.forgotten) + (same ? ", store identical" : ", differs"),
          .held = figures.forgotten == 0 && same});
}

TEST_F(CoordinatorKills, at_any_time_nothing_acknowledged_is_lost_and_little_is_done_again) {
  const int kills = full_counts() ? 100 : 6;
  Random random(1);
  int killed = 0, bakes = 0, identical = 0;
  std::uint64_t forgotten = 0;
  double most_tasks = 0;
  while (killed < kills && !HasFailure()) {
    InstantWorkers workers(endpoint(), work(1));
    Redone redone;
    for (bool done = false; !done;) {
      workers.connect_again();
      const std::uint64_t target = workers.figures().acknowledged + 1 + random.below(cells_ / 5);
      const auto coordinator = coordinate();
      const bool worked = wait_until(
          60, [&] { return workers.figures().acknowledged >= target || !coordinator->running(); });
      ASSERT_TRUE(worked) << coordinator->err();
      std::this_thread::sleep_for(std::chrono::microseconds(random.below(30'000)));
      if (killed < kills) coordinator->send(SIGKILL);
      const int code = coordinator->wait(60);
      ASSERT_TRUE(code == 0 || code == 128 + SIGKILL) << coordinator->err();
      done = code == 0;
      killed += done ? 0 : 1;
      redone.after_a_kill(workers.figures());
    }
    most_tasks = std::max(most_tasks, redone.most_tasks);
    ++bakes;
    identical += golden() ? 1 : 0;
    expect_nothing_lost(workers.figures());
    forgotten += workers.figures().forgotten;
    std::filesystem::remove(out_);
  }
  EXPECT_EQ(identical, bakes);
  EXPECT_LE(most_tasks, 2 * kSlots);
  record({.row = 3,
          .what = "acknowledged cells lost in " + std::to_string(killed) + " kills of " +
                  std::to_string(bakes) + " bakes",
          .asked = "0",
          .reached = std::to_string(forgotten) + ", " + std::to_string(identical) + " of " +
                     std::to_string(bakes) + " stores identical",
          .held = forgotten == 0 && identical == bakes && killed >= kills});
  record({.row = 3,
          .what = "cells done again after one kill, in tasks; two slots",
          .asked = "at most 4",
          .reached = std::to_string(most_tasks).substr(0, 4),
          .held = most_tasks <= 2 * kSlots});
}

}  // namespace pvsfarm

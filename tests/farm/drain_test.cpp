// Row 24 of the fault table, of workers by themselves: SIGTERM lets them finish and leave, whatever
// they are at.
#include "tests/farm/farm_fixture.hpp"
#include "tests/support/fault_figures.hpp"

namespace pvsfarm {
namespace {

class DrainTest : public FarmFixture {
 protected:
  // Of the worker with that process; nothing until it has joined.
  std::optional<std::uint32_t> leases_of(int pid) const {
    const auto report = status();
    if (!report) return std::nullopt;
    for (const StatusReport::Worker& worker : report->workers)
      if (static_cast<int>(worker.pid) == pid) return worker.leases;
    return std::nullopt;
  }
};

constexpr double kDrain_s = 25;

}  // namespace

// Half of them hold cells when they are told to leave, half have just joined.
TEST_F(DrainTest, workers_that_are_asked_to_leave_lose_nothing) {
  const int drains = full_counts() ? 50 : 10;
  const auto coordinator = coordinate();
  Crew workers = crew("worker");
  int told = 0, left = 0, with_cells = 0;
  for (; told < drains && coordinator->running(); ++told) {
    const std::size_t i = workers.start(endpoint(), "slow 10");
    const auto due = static_cast<std::uint64_t>(told * golden_cells_ / (2 * drains));
    std::optional<std::uint32_t> leases;
    ASSERT_TRUE(wait_until(60, [&] {
      leases = leases_of(workers.process(i).pid());
      return leases && (told % 2 == 1 || (*leases > 0 && cells_done() >= due));
    })) << workers.process(i).err();
    workers.send(i, SIGTERM);
    with_cells += *leases > 0 ? 1 : 0;
    const int code = workers.process(i).wait(kDrain_s);
    EXPECT_EQ(code, 0) << workers.process(i).err();
    left += code == 0 ? 1 : 0;
  }
  ASSERT_EQ(told, drains) << "the bake was over before";
  EXPECT_GE(with_cells, drains / 2);
  const auto report = status();
  ASSERT_TRUE(report);
  EXPECT_EQ(report->counters.leases_expired, 0U);
  // A connection that breaks on a busy machine is no fault of the worker.
  EXPECT_LE(report->counters.workers_lost, static_cast<std::uint64_t>(drains / 10))
      << coordinator->err();
  workers.start(endpoint());
  const Outcome result = outcome(*coordinator);
  EXPECT_TRUE(result.well()) << coordinator->err();
  const std::string by = " of " + std::to_string(drains) + " by SIGTERM, " +
                         std::to_string(with_cells) + " of them with cells";
  record({.row = 24,
          .what = "workers that left with 0 within 25 s" + by,
          .asked = std::to_string(drains),
          .reached = std::to_string(left),
          .held = left == drains});
  record({.row = 24,
          .what = "cells lost with workers that left by SIGTERM; the store's bytes",
          .asked = "0; identical",
          .reached =
              std::to_string(result.lost) + "; " + (result.identical ? "identical" : "DIFFERENT"),
          .held = result.well()});
}

}  // namespace pvsfarm

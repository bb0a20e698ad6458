// Row 10 of the fault table: a network that is cut for a while, one way or both, and says nothing.
#include "common/base/random.hpp"
#include "tests/farm/farm_fixture.hpp"
#include "tests/farm/faulty_proxy.hpp"
#include "tests/farm/two_hosts.hpp"
#include "tests/support/fault_figures.hpp"

namespace pvsfarm {
namespace {

using PartitionsTest = FarmFixture;

void sleep_s(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

enum class Cut { kToCoordinator, kToWorkers, kBoth };
constexpr Cut kCuts[] = {Cut::kToCoordinator, Cut::kToWorkers, Cut::kBoth};

}  // namespace

TEST_F(PartitionsTest, cut_networks_cost_time_only) {
  if (const std::string lacks = TwoHosts::missing(); !lacks.empty())
    GTEST_SKIP() << "needs " << lacks;
  // Length and number of the cuts, of each kind as many, in one bake each kind.
  struct Counts {
    double seconds;
    int cycles;
  };
  const std::vector<Counts> all =
      full_counts() ? std::vector<Counts>{{5, 6}, {15, 3}, {60, 1}} : std::vector<Counts>{{2.5, 1}};
  TwoHosts hosts(log("hosts"));
  int cycles = 0, bakes = 0, wells = 0;
  std::int64_t lost = 0;
  for (const Cut cut : kCuts) {
    const TwoHosts::Visit here(hosts, 0);
    const auto coordinator = coordinate();
    // Its keys are not asked on this machine's own addresses: the way there is through a door.
    const FaultyProxy door({.listen = TwoHosts::address(0), .upstream_port = port()});
    Crew workers = crew("worker");
    {
      const TwoHosts::Visit there(hosts, 1);
      for (int i = 0; i < 3; ++i)
        workers.start(door.endpoint(), full_counts() ? "slow 100" : "slow 10");
    }
    ASSERT_TRUE(reaches(5));
    for (const Counts& counts : all) {
      for (int cycle = 0; cycle < counts.cycles; ++cycle, ++cycles) {
        EXPECT_TRUE(coordinator->running()) << "over before the cut";
        if (cut != Cut::kToWorkers) hosts.receives(0, false);
        if (cut != Cut::kToCoordinator) hosts.receives(1, false);
        sleep_s(counts.seconds);
        hosts.heal();
        sleep_s(full_counts() ? 3 : 1);
      }
    }
    {
      // What is left need not be slow.
      const TwoHosts::Visit there(hosts, 1);
      workers.start(door.endpoint());
    }
    const Outcome result = outcome(*coordinator, 300);
    EXPECT_TRUE(result.well()) << coordinator->err();
    ++bakes;
    wells += result.well() ? 1 : 0;
    lost += result.lost + result.quarantined;
    for (std::size_t i = 0; i < workers.size(); ++i) workers.send(i, SIGKILL);
  }
  record({10, "cells lost in " + std::to_string(cycles) + " cuts", "0", std::to_string(lost),
          lost == 0});
  record({10, "stores identical", std::to_string(bakes) + " of " + std::to_string(bakes),
          std::to_string(wells) + " of " + std::to_string(bakes), wells == bakes});
}

}  // namespace pvsfarm

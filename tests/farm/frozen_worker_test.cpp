// Row 8 of the fault table: workers that are stopped for a minute, then go on as if nothing had
// been.
#include "common/base/random.hpp"
#include "tests/farm/farm_fixture.hpp"
#include "tests/support/fault_figures.hpp"

namespace pvsfarm {
namespace {

class FrozenWorkerTest : public FarmFixture {
 protected:
  std::uint32_t leases_of(int pid) const {
    const auto report = status();
    if (!report) return 0;
    for (const StatusReport::Worker& worker : report->workers)
      if (static_cast<int>(worker.pid) == pid) return worker.leases;
    return 0;
  }
};

struct Counts {
  int rounds, victims;
  double lease_s, frozen_s;
  const char* pace;  // of the worker that goes on: it has work for all that time
};

double seconds_since(TestClock::time_point start) {
  return std::chrono::duration<double>(TestClock::now() - start).count();
}

}  // namespace

TEST_F(FrozenWorkerTest, the_cells_of_frozen_workers_go_to_others_and_merge_once) {
  const Counts counts =
      full_counts() ? Counts{4, 5, 30, 60, "slow 60"} : Counts{1, 4, 3, 6, "slow 8"};
  Outcome all;
  int frozen = 0, taken_back = 0, wells = 0;
  double longest_s = 0;
  for (int round = 0; round < counts.rounds; ++round) {
    const auto coordinator = coordinate({"--lease", std::to_string(counts.lease_s)});
    Crew workers = crew("worker");
    for (int i = 0; i < counts.victims; ++i) workers.start(endpoint(), "slow 20");
    std::vector<TestClock::time_point> since(workers.size());
    for (std::size_t i = 0; i < workers.size(); ++i) {
      ASSERT_TRUE(wait_until(30, [&] { return leases_of(workers.process(i).pid()) > 0; }));
      workers.send(i, SIGSTOP);
      since[i] = TestClock::now();
      ++frozen;
    }
    workers.start(endpoint(), counts.pace);
    std::vector<bool> back(workers.size());
    for (const auto start = TestClock::now(); seconds_since(start) < counts.frozen_s;) {
      const std::string text = coordinator->err();
      for (std::size_t i = 0; i < since.size(); ++i) {
        const std::string name = ":" + std::to_string(workers.process(i).pid()) + ": ";
        if (back[i] || text.find(name) == std::string::npos) continue;
        back[i] = true;
        ++taken_back;
        longest_s = std::max(longest_s, seconds_since(since[i]));
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    EXPECT_TRUE(coordinator->running()) << "over before they went on: nothing was late";
    for (std::size_t i = 0; i < since.size(); ++i) workers.send(i, SIGCONT);
    workers.start(endpoint());  // what is left need not be slow
    const Outcome result = outcome(*coordinator, 200);
    EXPECT_TRUE(result.well()) << coordinator->err();
    wells += result.well() ? 1 : 0;
    all.twice += result.twice;
    all.lost += result.lost;
  }
  EXPECT_EQ(taken_back, frozen);
  EXPECT_LE(longest_s, counts.lease_s + 10);
  const std::string who = std::to_string(frozen) + " workers stopped for " +
                          std::to_string(static_cast<int>(counts.frozen_s)) + " s";
  char longest[32];
  std::snprintf(longest, sizeof longest, "%.1f s", longest_s);
  record({8, "longest until the cells were given to others, " + who,
          std::to_string(static_cast<int>(counts.lease_s + 10)) + " s or less", longest,
          taken_back == frozen && longest_s <= counts.lease_s + 10});
  record({8, "cells merged twice", "0", std::to_string(all.twice), all.twice == 0});
  record({8, "stores identical",
          std::to_string(counts.rounds) + " of " + std::to_string(counts.rounds),
          std::to_string(wells) + " of " + std::to_string(counts.rounds), wells == counts.rounds});
}

}  // namespace pvsfarm

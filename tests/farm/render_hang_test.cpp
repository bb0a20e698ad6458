// Row 9 of the fault table: a computation that hangs while its worker's network lives.
#include "common/base/random.hpp"
#include "tests/farm/farm_fixture.hpp"
#include "tests/support/fault_figures.hpp"

namespace pvsfarm {
namespace {

class RenderHangTest : public FarmFixture {
 protected:
  // How long ago it was heard; nothing if it is not known.
  std::optional<std::uint64_t> silent_ms(int pid) const {
    const auto report = status();
    if (!report) return std::nullopt;
    for (const StatusReport::Worker& worker : report->workers)
      if (static_cast<int>(worker.pid) == pid) return worker.silent_ms;
    return std::nullopt;
  }
};

}  // namespace

TEST_F(RenderHangTest, a_hanging_computation_loses_its_cells_though_its_worker_answers) {
  const int rounds = full_counts() ? 4 : 1, victims = full_counts() ? 5 : 3;
  const std::string lease_s = full_counts() ? "30" : "3";
  Random random(9);
  int hung = 0, caught = 0, wells = 0;
  for (int round = 0; round < rounds; ++round) {
    const auto coordinator = coordinate({"--lease", lease_s});
    Crew workers = crew("worker");
    for (int i = 0; i < victims; ++i, ++hung)
      workers.start(endpoint(), "hang " + std::to_string(2 + random.below(60)));
    const auto told_of = [&](std::size_t i) {
      const std::string name = ":" + std::to_string(workers.process(i).pid()) + ": no progress";
      return coordinator->err().find(name) != std::string::npos;
    };
    for (std::size_t i = 0; i < workers.size(); ++i) {
      if (!wait_until(std::stod(lease_s) + 10, [&] { return told_of(i); })) continue;
      const auto silent = silent_ms(workers.process(i).pid());
      EXPECT_TRUE(silent && *silent < 5'000) << "its network does not live";
      ++caught;
    }
    workers.start(endpoint());
    const Outcome result = outcome(*coordinator, 200);
    EXPECT_TRUE(result.well()) << coordinator->err();
    wells += result.well() ? 1 : 0;
    for (std::size_t i = 0; i < workers.size(); ++i)
      EXPECT_EQ(workers.process(i).wait(10), 0) << "did not leave when all was over";
  }
  EXPECT_EQ(caught, hung);
  const auto of = [](int part, int all) {
    return std::to_string(part) + " of " + std::to_string(all);
  };
  record({9, "hanging computations noticed within their lease and 10 s", of(hung, hung),
          of(caught, hung), caught == hung});
  record({9, "stores identical", of(rounds, rounds), of(wells, rounds), wells == rounds});
}

TEST_F(RenderHangTest, a_bake_whose_own_workers_all_hang_goes_on_with_new_ones) {
  if (!full_counts()) GTEST_SKIP() << "takes minutes: PVSFARM_FULL=1";
  // Each process computes for a while, then hangs: without an end to that nothing would move.
  std::vector<std::string> command{"/usr/bin/env", "LD_PRELOAD=" PVSFARM_FAULT_PRELOAD,
                                   "PVSFARM_FAULT=hang 1500"};
  const auto bake_words = bake_command(out_, {"--workers", "2", "--lease", "2"});
  command.insert(command.end(), bake_words.begin(), bake_words.end());
  Process bake(command, log("bake"));
  const Outcome result = outcome(bake, 300);
  EXPECT_TRUE(result.well()) << bake.err();
  EXPECT_NE(bake.err().find("exit code 75"), std::string::npos) << bake.err();
}

}  // namespace pvsfarm

// Row 2 of the fault table: workers that are killed, also in the middle of an upload.
#include "common/base/random.hpp"
#include "tests/farm/farm_fixture.hpp"
#include "tests/farm/faulty_proxy.hpp"
#include "tests/support/fault_figures.hpp"

namespace pvsfarm {
namespace {

class WorkerKillsTest : public FarmFixture {
 protected:
  bool holds_cells(Crew& crew, std::size_t i) const {
    const auto report = status();
    if (!report) return false;
    for (const StatusReport::Worker& worker : report->workers)
      if (static_cast<int>(worker.pid) == crew.process(i).pid()) return worker.leases > 0;
    return false;
  }
};

constexpr std::size_t kWorkers = 3;
constexpr std::uint64_t kUploadBytes = 400;  // less than a result, more than a heartbeat

void send_others(Crew& crew, std::size_t victim, int signal) {
  for (std::size_t i = 0; i < crew.size(); ++i)
    if (i != victim) crew.send(i, signal);
}

}  // namespace

TEST_F(WorkerKillsTest, killed_workers_cost_time_only) {
  const int kills = full_counts() ? 50 : 16;
  Random random(2);
  const auto coordinator = coordinate();
  std::vector<std::unique_ptr<FaultyProxy>> proxies;
  Crew workers = crew("worker");
  for (std::size_t i = 0; i < kWorkers; ++i) {
    proxies.push_back(std::make_unique<FaultyProxy>(ProxyOptions{.upstream_port = port()}));
    workers.start(proxies[i]->endpoint(), full_counts() ? "slow 10" : "slow 3");  // time for all
  }
  int killed = 0, in_upload = 0;
  const auto over = [&] { return !coordinator->running(); };
  for (; killed < kills && !over(); ++killed) {
    // Over the first half of the bake, of workers that have something to lose.
    const std::uint64_t due = static_cast<std::uint64_t>(killed * golden_cells_ / (2 * kills));
    const std::size_t victim = random.below(kWorkers);
    wait_until(60, [&] { return over() || (cells_done() >= due && holds_cells(workers, victim)); });
    const std::uint64_t cuts = proxies[victim]->figures().cuts;
    if (random.below(2) == 0) {
      // The others wait meanwhile, or they would have done it all before the fiftieth.
      send_others(workers, victim, SIGSTOP);
      proxies[victim]->cut_next_upload(kUploadBytes);
      wait_until(20, [&] { return over() || proxies[victim]->figures().cuts > cuts; });
      send_others(workers, victim, SIGCONT);
    }
    if (over() || !workers.running(victim)) break;
    workers.kill(victim);
    in_upload += proxies[victim]->figures().cuts > cuts ? 1 : 0;
    ASSERT_TRUE(wait_until(5, [&] { return !workers.running(victim); }));
    workers.start_fallen();
  }
  const Outcome result = outcome(*coordinator);
  EXPECT_EQ(killed, kills) << "the bake was over before";
  EXPECT_GE(in_upload, kills / 4);
  EXPECT_TRUE(result.well()) << coordinator->err();
  const std::string of = " of " + std::to_string(golden_cells_) + " cells, " +
                         std::to_string(killed) + " workers killed, " + std::to_string(in_upload) +
                         " of them in mid-upload";
  record({2, "lost" + of, "0", std::to_string(result.lost), result.lost == 0});
  record({2, "merged twice" + of, "0", std::to_string(result.twice), result.twice == 0});
  record({2, "the store's bytes", "identical", result.identical ? "identical" : "DIFFERENT",
          result.identical && killed == kills});
}

}  // namespace pvsfarm

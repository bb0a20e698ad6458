// A scene of 1 GiB on its way to a worker that has never seen it, over a link of 100 Mbit/s that
// loses 1 % of the packets: it goes on after the network was dead for a while, after a connection
// was reset, and after the worker was killed. (Fewer bytes and a slower link in a plain run.)
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/farm/farm_fixture.hpp"
#include "tests/farm/faulty_proxy.hpp"
#include "tests/farm/two_hosts.hpp"
#include "tests/support/fault_figures.hpp"

namespace pvsfarm {
namespace {

namespace fs = std::filesystem;

struct Counts {
  std::uint64_t mib;
  double mbit_per_s, dead_s;
};

class LargeSceneTest : public FarmFixture {
 protected:
  std::unique_ptr<Process> start_coordinator(std::uint64_t bytes) {
    auto process = std::make_unique<Process>(
        std::vector<std::string>{PVSFARM_LARGE_SCENE_COORDINATOR, suite_ + "/city.obj",
                                 suite_ + "/city.cells.json", suite_ + "/city.tags.json",
                                 std::to_string(bytes), out_, "tcp://127.0.0.1:*"},
        log("coordinator"));
    await_endpoint(*process, 300);
    return process;
  }
  bool fetched(std::uint64_t bytes) const {
    return wait_until(600, [&] { return door_->figures().bytes_down > bytes; });
  }
  // The scene in the worker's cache, once it is whole; "" before.
  std::string cached() const {
    for (const auto& entry : fs::directory_iterator(folder_ + "/cache"))
      if (entry.path().extension() == ".scene") return entry.path();
    return "";
  }

  std::unique_ptr<FaultyProxy> door_;
};

bool same_bytes(const std::string& a, const std::string& b) {
  std::ifstream first(a, std::ios::binary), second(b, std::ios::binary);
  std::vector<char> x(1 << 20), y(1 << 20);
  while (first && second) {
    first.read(x.data(), static_cast<std::streamsize>(x.size()));
    second.read(y.data(), static_cast<std::streamsize>(y.size()));
    if (first.gcount() != second.gcount() || x != y) return false;
  }
  return !first && !second;
}

}  // namespace

TEST_F(LargeSceneTest, arrives_over_a_lossy_link_and_resumes_after_every_cut) {
  if (const std::string lacks = TwoHosts::missing(); !lacks.empty())
    GTEST_SKIP() << "needs " << lacks;
  const Counts counts = full_counts() ? Counts{1024, 100, 15} : Counts{12, 40, 2};
  const std::uint64_t bytes = counts.mib << 20;
  TwoHosts hosts(log("hosts"));
  hosts.rate(counts.mbit_per_s);
  const auto lossy = [&] {
    for (int host = 0; host < 2; ++host) hosts.receives(host, true, 1);
  };
  lossy();
  std::unique_ptr<Process> coordinator;
  {
    const TwoHosts::Visit here(hosts, 0);
    coordinator = start_coordinator(bytes);
    door_ = std::make_unique<FaultyProxy>(
        ProxyOptions{.listen = TwoHosts::address(0), .upstream_port = port()});
  }
  ASSERT_GE(hide_scene(), bytes);

  const TwoHosts::Visit there(hosts, 1);
  const auto start = TestClock::now();
  Crew workers = crew("worker");
  workers.start(door_->endpoint());
  ASSERT_TRUE(fetched(bytes / 4));
  for (int host = 0; host < 2; ++host) hosts.receives(host, false);
  std::this_thread::sleep_for(std::chrono::duration<double>(counts.dead_s));
  lossy();
  ASSERT_TRUE(fetched(bytes / 2));
  door_->reset_all();
  ASSERT_TRUE(fetched(bytes / 4 * 3));
  workers.kill(0);
  ASSERT_TRUE(wait_until(5, [&] { return !workers.running(0); }));
  workers.start_fallen();

  ASSERT_TRUE(wait_until(600, [&] { return !cached().empty(); })) << workers.process(0).err();
  const double took_s = std::chrono::duration<double>(TestClock::now() - start).count();
  const std::uint64_t sent = door_->figures().bytes_down;
  EXPECT_NE(workers.process(0).err().find("are here"), std::string::npos)
      << "the worker that was started again began anew: " << workers.process(0).err();
  const bool intact = same_bytes(hidden_scene(), cached());
  EXPECT_TRUE(intact);
  // What was on its way at each cut went twice.
  const bool resumed = sent > bytes && sent < bytes + bytes / 20 + 3 * (8u << 20);
  EXPECT_TRUE(resumed) << sent << " bytes for a scene of " << bytes;
  const int code = coordinator->wait(120);
  EXPECT_EQ(code, 0) << coordinator->err();
  EXPECT_EQ(coordinator->out(), std::to_string(golden_cells_) + "\n");

  std::ostringstream what, reached;
  what << "a scene of " << counts.mib << " MiB at " << counts.mbit_per_s
       << " Mbit/s with 1 % loss, 3 cuts";
  reached << (intact ? "intact" : "damaged") << " after " << static_cast<int>(took_s) << " s, "
          << static_cast<int>(counts.dead_s) << " of them without a network; "
          << ((sent - bytes) >> 20) << " MiB went twice";
  record({11, what.str(), "intact, resumes", reached.str(), intact && resumed && code == 0});
}

}  // namespace pvsfarm

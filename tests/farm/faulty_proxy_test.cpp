// Row 12 of the fault table: bits that flip on the way, connections that are reset.
#include "tests/farm/faulty_proxy.hpp"
#include "common/base/random.hpp"
#include "tests/farm/farm_fixture.hpp"
#include "tests/support/fault_figures.hpp"

namespace pvsfarm {
namespace {

using FaultyProxyTest = FarmFixture;

}  // namespace

TEST_F(FaultyProxyTest, flipped_bits_and_resets_never_reach_the_store) {
  const std::uint64_t flips = full_counts() ? 1'000 : 30, resets = full_counts() ? 200 : 8;
  std::uint64_t flipped = 0, reset = 0;
  std::int64_t corrupt = 0;
  int bakes = 0, wells = 0;
  Random random(12);
  while ((flipped < flips || reset < resets) && bakes < 200) {
    const auto coordinator = coordinate({"--lease", "5"});
    FaultyProxy proxy({.upstream_port = port(), .seed = random.next()});
    Crew workers = crew("worker");
    for (int i = 0; i < 4; ++i) workers.start(proxy.endpoint(), "slow 2");
    proxy.flip_every(4'000);
    auto next_reset = TestClock::now() + std::chrono::seconds(1);
    while (coordinator->running()) {
      const ProxyFigures now = proxy.figures();
      if (flipped + now.flips >= flips) proxy.flip_every(0);
      if (TestClock::now() > next_reset && reset + now.resets < resets) {
        proxy.reset_all();
        next_reset = TestClock::now() + std::chrono::milliseconds(500 + random.below(1'000));
      }
      workers.start_fallen();  // as whoever runs workers does when they end with 75
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    const Outcome result = outcome(*coordinator);
    EXPECT_TRUE(result.well()) << coordinator->err();
    ++bakes;
    wells += result.well() ? 1 : 0;
    corrupt += result.disagreements + (result.identical ? 0 : 1);
    flipped += proxy.figures().flips;
    reset += proxy.figures().resets;
    for (std::size_t i = 0; i < workers.size(); ++i) workers.kill(i);
  }
  EXPECT_GE(flipped, flips);
  EXPECT_GE(reset, resets);
  const std::string of = ", " + std::to_string(flipped) + " flips, " + std::to_string(reset) +
                         " resets, " + std::to_string(bakes) + " bakes";
  record({12, "corrupt merges" + of, "0", std::to_string(corrupt),
          corrupt == 0 && flipped >= flips && reset >= resets});
  record({12, "stores identical", std::to_string(bakes) + " of " + std::to_string(bakes),
          std::to_string(wells) + " of " + std::to_string(bakes), wells == bakes});
}

}  // namespace pvsfarm

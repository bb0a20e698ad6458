// A coordinator whose disk fails or fills up: it ends at once, or waits for room; what it has
// acknowledged is there afterwards, and the store is the same.
#include <sys/mount.h>

#include <fstream>

#include "common/base/random.hpp"
#include "tests/farm/durable_farm.hpp"
#include "tests/support/fault_figures.hpp"

namespace pvsfarm {
namespace {

namespace fs = std::filesystem;

double now_s() {
  return std::chrono::duration<double>(TestClock::now().time_since_epoch()).count();
}

class DiskFailures : public DurableFarm {
 protected:
  // Fills the disk of `folder` but for a few pages; the second file's removal makes room.
  static void fill(const std::string& folder) {
    for (const char* name : {"/ballast-1", "/ballast-2"}) {
      std::ofstream file(folder + name, std::ios::binary);
      const std::string block(4096, 'x');
      const bool all = std::string(name) == "/ballast-2";
      for (int blocks = 0; all || blocks < 256; ++blocks)
        if (!file.write(block.data(), 4096).flush()) break;
    }
  }
  std::uint64_t acknowledged_within(const InstantWorkers& workers, double seconds) const {
    const std::uint64_t before = workers.figures().acknowledged;
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    return workers.figures().acknowledged - before;
  }
};

// A file system of 8 MiB, as long as the test runs.
struct SmallDisk {
  std::string path;
  bool mounted = false;
  explicit SmallDisk(std::string where) : path(std::move(where)) {
    mounted = mount("pvsfarm-test", path.c_str(), "tmpfs", 0, "size=8m") == 0;
  }
  ~SmallDisk() {
    if (mounted) umount2(path.c_str(), MNT_DETACH);
  }
};

}  // namespace

TEST_F(DiskFailures, a_sync_that_fails_ends_the_coordinator_and_power_lost_then_costs_nothing) {
  const int points = full_counts() ? 100 : 6;
  Random random(6);
  int failed = 0, bakes = 0, identical = 0;
  std::uint64_t forgotten = 0;
  double longest_s = 0;
  while (failed < points && !HasFailure()) {
    InstantWorkers workers(endpoint(), work(0.5));
    for (bool done = false; !done;) {
      workers.connect_again();
      const std::string n = std::to_string(failed < points ? 1 + random.below(30) : 0);
      const auto coordinator = coordinate("sync:-wal:" + n + ":fail-and-power", random.next() >> 8);
      const int code = coordinator->wait(60);
      const double ended_s = now_s(), fault = fault_s(*coordinator);
      done = code == 0;
      ASSERT_EQ(code, fault > 0 ? 75 : 0) << coordinator->err();
      if (done) continue;
      ++failed;
      longest_s = std::max(longest_s, ended_s - fault);
      EXPECT_NE(coordinator->err().find("same command"), std::string::npos) << coordinator->err();
    }
    forgotten += workers.figures().forgotten;
    ++bakes;
    identical += golden() ? 1 : 0;
    fs::remove(out_);
  }
  EXPECT_EQ(forgotten, 0u);
  EXPECT_EQ(identical, bakes);
  EXPECT_LE(longest_s, 1.0);
  const std::string at = " at " + std::to_string(failed) + " syncs of the journal that fail";
  record({.row = 6,
          .what = "time to the coordinator's end" + at,
          .asked = "at most 1 s",
          .reached = std::to_string(longest_s).substr(0, 5) + " s",
          .held = longest_s <= 1});
  record({.row = 6,
          .what = "acknowledged cells lost" + at + " and lose what they should keep",
          .asked = "0, identical",
          .reached = std::to_string(forgotten) + ", " + std::to_string(identical) + " of " +
                     std::to_string(bakes) + " stores identical",
          .held = forgotten == 0 && identical == bakes && failed >= points});
}

TEST_F(DiskFailures, a_full_disk_is_waited_for) {
  const std::string folder = fs::path(out_).parent_path().string();
  const SmallDisk disk(folder);
  if (!disk.mounted) GTEST_SKIP() << "mounting a small file system is not permitted here";
  InstantWorkers workers(endpoint(), work(1));
  const auto coordinator = coordinate();
  ASSERT_TRUE(wait_until(60, [&] { return workers.figures().acknowledged > 20; }));
  fill(folder);
  ASSERT_TRUE(wait_until(60, [&] {
    return coordinator->err().find("disk is full") != std::string::npos || !coordinator->running();
  })) << coordinator->err();
  EXPECT_EQ(acknowledged_within(workers, full_counts() ? 20 : 6), 0u);
  ASSERT_TRUE(coordinator->running()) << coordinator->err();
  const std::uint64_t before = workers.figures().acknowledged;
  ASSERT_LT(before, cells_);

  fs::remove(folder + "/ballast-1");
  fs::remove(folder + "/ballast-2");
  const double freed_s = now_s();
  EXPECT_TRUE(wait_until(20, [&] { return workers.figures().acknowledged > before; }));
  const double resumed_s = now_s() - freed_s;
  EXPECT_LE(resumed_s, 5.0);
  EXPECT_EQ(coordinator->wait(60), 0) << coordinator->err();
  const bool same = golden();
  EXPECT_TRUE(same);
  const std::string said = coordinator->err();
  EXPECT_EQ(said.find("disk is full"), said.rfind("disk is full")) << said;
  EXPECT_NE(said.find("room again"), std::string::npos) << said;
  EXPECT_EQ(said.find("lost"), said.rfind("lost")) << said;  // "nothing is lost"
  record({.row = 7,
          .what = "time to the next acknowledgement once there is room on a full disk",
          .asked = "at most 5 s, 0 lost",
          .reached = std::to_string(resumed_s).substr(0, 4) + " s, store " +
                     (same ? "identical" : "differs"),
          .held = resumed_s <= 5 && same});
}

TEST_F(DiskFailures, a_disk_that_is_full_when_the_store_is_written_is_waited_for) {
  int written = 0;
  for (const char* file : {"city.pvs.partial", "city.pvs.stats.partial"}) {
    InstantWorkers workers(endpoint(), work(0));
    const auto coordinator = coordinate(std::string("write:") + file + ":1:fail-full", 1);
    ASSERT_EQ(coordinator->wait(60), 0) << coordinator->err();
    EXPECT_GT(fault_s(*coordinator), 0) << "nothing failed";
    const std::string said = coordinator->err();
    EXPECT_NE(said.find("No space left on device"), std::string::npos) << said;
    EXPECT_NE(said.find("as soon as there is room"), std::string::npos) << said;
    EXPECT_NE(said.find("there is room again"), std::string::npos) << said;
    EXPECT_TRUE(golden());
    written += golden() ? 1 : 0;
    fs::remove(out_);
  }
  record({.row = 7,
          .what = "stores written after all, of 2 that found the disk full at their end",
          .asked = "2",
          .reached = std::to_string(written),
          .held = written == 2});
}

}  // namespace pvsfarm

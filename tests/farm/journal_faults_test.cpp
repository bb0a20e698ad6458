// The journal, the final file and the removal of the journal under a disk that fails: killed in the
// middle of every write, cut off from power anywhere, told by every sync in turn that it failed.
// What was acknowledged is there afterwards, and the file comes out the same.
#include <filesystem>
#include <set>
#include <sstream>

#include "common/base/random.hpp"
#include "tests/farm/process.hpp"
#include "tests/support/fault_figures.hpp"

namespace pvsfarm {
namespace {

namespace fs = std::filesystem;

struct DriverRun {
  int code = 0;
  bool faulted = false, acknowledged_after_fault = false, done = false;
  std::set<int> has, acknowledged;
  long calls = 0;
  std::string err;
};

class JournalFaults : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    // In memory if possible: the faults are ours, so the syncs need not cost anything.
    std::string pattern =
        (fs::exists("/dev/shm") ? "/dev/shm/" : testing::TempDir()) + "disk-XXXXXX";
    suite_ = mkdtemp(pattern.data());
    fs::create_directories(suite_ + "/golden");
    const DriverRun clean = run(suite_ + "/golden");
    ASSERT_EQ(clean.code, 0) << clean.err;
    ASSERT_TRUE(clean.done);
    golden_ = read_file(suite_ + "/golden/out").value();
  }
  static void TearDownTestSuite() { fs::remove_all(suite_); }
  void SetUp() override {
    folder_ = suite_ + "/run";
    begin_anew();
  }
  void begin_anew() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    acknowledged_.clear();
  }

  // `fault`: OP:PATH:N:ACTION of faulty_disk.cpp.
  static DriverRun run(const std::string& folder, const std::string& fault = "",
                       std::uint64_t seed = 0) {
    if (!fault.empty()) {
      setenv("LD_PRELOAD", PVSFARM_FAULTY_DISK, 1);
      setenv("PVSFARM_DISK_FOLDER", folder.c_str(), 1);
      setenv("PVSFARM_DISK_FAULT", fault.c_str(), 1);
      setenv("PVSFARM_DISK_SEED", std::to_string(seed).c_str(), 1);
    }
    Process process({PVSFARM_JOURNAL_DRIVER, folder + "/out", "60", "7", "12"}, suite_ + "/log");
    unsetenv("LD_PRELOAD");
    DriverRun result;
    result.code = process.wait(60);
    result.err = process.err();
    std::istringstream lines(process.out());
    std::string word;
    long number = 0;
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      words >> word >> number;
      if (word == "fault") result.faulted = true;
      if (word == "has") result.has.insert(static_cast<int>(number));
      if (word == "done") result.done = true;
      if (word == "calls") result.calls = number;
      if (word != "ack") continue;
      result.acknowledged.insert(static_cast<int>(number));
      result.acknowledged_after_fault |= result.faulted;
    }
    return result;
  }
  DriverRun faulty(const std::string& fault, std::uint64_t seed = 0) {
    DriverRun made = run(folder_, fault, seed);
    note(made);
    return made;
  }
  void note(const DriverRun& run) {
    for (const int row : run.acknowledged) acknowledged_.insert(row);
  }
  // Rows that were acknowledged and are not there, and the same of a file with other bytes.
  int violations_after_restart() {
    const bool finished = fs::exists(folder_ + "/out") && !fs::exists(folder_ + "/out.journal");
    const DriverRun again = run(folder_);
    EXPECT_EQ(again.code, 0) << again.err;
    int violations = again.code == 0 && again.done ? 0 : 1;
    for (const int row : acknowledged_) violations += finished || again.has.count(row) > 0 ? 0 : 1;
    const auto file = read_file(folder_ + "/out");
    const bool golden = file && *file == golden_;
    EXPECT_TRUE(golden);
    return violations + (golden ? 0 : 1);
  }
  static long calls_of(const std::string& op) {
    const std::string folder = suite_ + "/count";
    fs::remove_all(folder);
    fs::create_directories(folder);
    return run(folder, op + "::0:before").calls;
  }

  static std::string suite_, golden_;
  std::string folder_;
  std::set<int> acknowledged_;
};
std::string JournalFaults::suite_, JournalFaults::golden_;

std::string of(std::uint64_t count, std::uint64_t all) {
  return std::to_string(count) + " of " + std::to_string(all);
}

}  // namespace

TEST_F(JournalFaults, killed_in_the_middle_of_every_write) {
  const long writes = calls_of("write");
  ASSERT_GT(writes, 100);
  const long step = full_counts() ? 1 : 3;
  int violations = 0, kills = 0;
  for (long n = 1; n <= writes; n += step) {
    SCOPED_TRACE("write " + std::to_string(n));
    begin_anew();
    const DriverRun killed = faulty("write::" + std::to_string(n) + ":half");
    ASSERT_EQ(killed.code, 128 + SIGKILL) << killed.err;
    ++kills;
    // Now and then what mends it is killed, too.
    if (n % 4 == 0) faulty("write::" + std::to_string(1 + n % 9) + ":half");
    violations += violations_after_restart();
    if (HasFailure()) break;
  }
  EXPECT_EQ(violations, 0);
  record({.row = 4,
          .what = "violations, killed in the middle of " + of(kills, writes) + " writes",
          .asked = "0",
          .reached = std::to_string(violations),
          .held = violations == 0});
}

// Kill points by name: a call of the system is one, so none had to be built in.
TEST_F(JournalFaults, killed_before_and_after_every_sync_rename_removal_and_cut) {
  int violations = 0, kills = 0;
  for (const std::string op : {"sync", "fold", "rename", "unlink", "cut"}) {
    const long calls = calls_of(op);
    ASSERT_GT(calls, 0) << op;
    for (long n = 1; n <= calls; n += full_counts() || calls < 5 ? 1 : 3)
      for (const std::string when : {"before", "after"}) {
        SCOPED_TRACE(op + " " + std::to_string(n) + " " + when);
        begin_anew();
        const DriverRun killed = faulty(op + "::" + std::to_string(n) + ":" + when);
        ASSERT_EQ(killed.code, 128 + SIGKILL) << killed.err;
        ++kills;
        violations += violations_after_restart();
        if (HasFailure()) return;
      }
  }
  EXPECT_EQ(violations, 0);
  record(
      {.row = 3,
       .what = "violations, journal and file killed before and after syncs, renames, removals: " +
               std::to_string(kills) + " kills",
       .asked = "0",
       .reached = std::to_string(violations),
       .held = violations == 0});
}

TEST_F(JournalFaults, power_cut_anywhere_with_any_of_the_unsynced_writes_lost) {
  const auto calls = static_cast<std::uint64_t>(calls_of("any"));
  const std::uint64_t seeds = full_counts() ? 1000 : 120;
  int violations = 0;
  std::uint64_t seed = 1;
  for (; seed <= seeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    begin_anew();
    Random random(seed);
    const auto cut = [&](std::uint64_t limit) {
      return "any::" + std::to_string(1 + random.below(limit)) + ":power";
    };
    const DriverRun killed = faulty(cut(calls), seed);
    ASSERT_EQ(killed.code, 128 + SIGKILL) << killed.err;
    if (seed % 3 == 0) faulty(cut(40), seed);
    violations += violations_after_restart();
    if (HasFailure()) break;
  }
  EXPECT_EQ(violations, 0);
  record({.row = 5,
          .what = "violations in " + std::to_string(seed - 1) + " power cuts",
          .asked = "0",
          .reached = std::to_string(violations),
          .held = violations == 0 && seed > seeds});
}

TEST_F(JournalFaults, every_sync_fails_once_and_nothing_is_acknowledged_after_it) {
  const long syncs = calls_of("sync");
  ASSERT_GT(syncs, 10);
  int violations = 0, points = 0;
  for (long n = 1; n <= syncs; ++n) {
    SCOPED_TRACE("sync " + std::to_string(n));
    begin_anew();
    // When the program has gone the power fails, too, and takes what that sync was to keep.
    const DriverRun failed =
        faulty("sync::" + std::to_string(n) + ":fail-and-power", static_cast<std::uint64_t>(n));
    ASSERT_TRUE(failed.faulted);
    ++points;
    // The first is of the journal's own making: an output that cannot be written.
    const bool while_it_runs = failed.code == 75;
    EXPECT_TRUE(while_it_runs || failed.code == 2) << failed.code << failed.err;
    EXPECT_EQ(while_it_runs, failed.err.find("same command") != std::string::npos) << failed.err;
    EXPECT_FALSE(failed.acknowledged_after_fault);
    violations += failed.acknowledged_after_fault ? 1 : 0;
    violations += violations_after_restart();
    if (HasFailure()) break;
  }
  EXPECT_EQ(violations, 0);
  record({.row = 6,
          .what = "violations of the journal at " + std::to_string(points) + " syncs that fail",
          .asked = "0",
          .reached = std::to_string(violations),
          .held = violations == 0});
}

// A killed process has written what only the system's memory holds. Whoever goes on must not
// acknowledge it before it is on the disk.
TEST_F(JournalFaults, what_an_earlier_process_did_not_sync_is_synced_before_it_counts) {
  int kept = 0;
  for (std::uint64_t seed = 0; seed < (full_counts() ? 150 : 50); ++seed) {
    const std::uint64_t n = 1 + seed % 25;
    SCOPED_TRACE("seed " + std::to_string(seed));
    begin_anew();
    fs::remove_all(suite_ + "/kept");
    fs::create_directories(suite_ + "/kept");
    setenv("PVSFARM_DISK_KEPT", (suite_ + "/kept").c_str(), 1);
    faulty("any::" + std::to_string(30 + seed % 37) + ":before");
    const DriverRun again = faulty("any::" + std::to_string(n) + ":power", seed);
    unsetenv("PVSFARM_DISK_KEPT");
    acknowledged_.insert(again.has.begin(), again.has.end());
    kept += again.has.empty() ? 0 : 1;
    EXPECT_EQ(violations_after_restart(), 0);
    if (HasFailure()) break;
  }
  EXPECT_GT(kept, 2);
}

TEST_F(JournalFaults, every_write_fails_once_and_nothing_is_acknowledged_after_it) {
  const long writes = calls_of("write");
  for (long n = 1; n <= writes; n += full_counts() ? 1 : 5) {
    SCOPED_TRACE("write " + std::to_string(n));
    begin_anew();
    const DriverRun failed = faulty("write::" + std::to_string(n) + ":fail");
    EXPECT_TRUE(failed.code == 75 || failed.code == 2) << failed.code << failed.err;
    EXPECT_FALSE(failed.acknowledged_after_fault);
    EXPECT_EQ(violations_after_restart(), 0);
    if (HasFailure()) break;
  }
}

}  // namespace pvsfarm

// Row 16 of the fault table: cells that no worker can evaluate, and workers that always crash. The
// rest must be finished, and what is missing must be said.
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/pvs/store_reader.hpp"
#include "tests/farm/farm_fixture.hpp"
#include "tests/support/fault_figures.hpp"

namespace pvsfarm {
namespace {

constexpr int kIncomplete = 6;

class PoisonTest : public FarmFixture {
 protected:
  static void SetUpTestSuite() {
    FarmFixture::SetUpTestSuite();
    golden_store_ = StoreReader::open(suite_ + "/golden.pvs").value();
    Box all;
    for (const auto& object : golden_store_->objects().value()) all.add(object.box);
    center_ = all.center();
  }
  static void TearDownTestSuite() {
    golden_store_.reset();
    FarmFixture::TearDownTestSuite();
  }

  // The middle of the root cell of this number, for a fault in it and in no other.
  static std::string place(std::int64_t root) {
    for (std::uint32_t i = 0; i < golden_store_->node_count(); ++i) {
      const StoredNode node = golden_store_->node(i).value();
      if (node.root_id != root || node.key.depth() != 0) continue;
      const Vec3 middle = node.cell.center() - center_;
      const Vec3 reach = (node.cell.hi - node.cell.lo) * 0.4;
      std::ostringstream text;
      text << ' ' << middle.x - reach.x << ' ' << middle.x + reach.x << ' ' << middle.y - reach.y
           << ' ' << middle.y + reach.y;
      return text.str();
    }
    ADD_FAILURE() << "no root " << root;
    return "";
  }

  // A root's cells in the order of the store.
  using Sets = std::vector<std::pair<CellKey, std::vector<ObjectId>>>;
  static std::map<std::int64_t, Sets> sets_of(const std::string& path) {
    std::map<std::int64_t, Sets> sets;
    const auto store = StoreReader::open(path).value();
    for (std::uint32_t i = 0; i < store->node_count(); ++i) {
      const StoredNode node = store->node(i).value();
      std::vector<ObjectId> visible;
      store->sets(i)->visible.for_each([&](ObjectId id) { visible.push_back(id); });
      sets[node.root_id].emplace_back(node.key, std::move(visible));
    }
    return sets;
  }
  // The poisoned root keeps everything, all others are as they should be. True: so it is.
  bool only_poisoned(std::int64_t root) const {
    auto expected = sets_of(suite_ + "/golden.pvs"), found = sets_of(out_);
    const Sets poisoned = found[root];
    EXPECT_EQ(poisoned.size(), 1u);
    EXPECT_EQ(poisoned.at(0).second.size(), golden_store_->objects()->size());
    const bool whole =
        poisoned.size() == 1 && poisoned.at(0).second.size() == golden_store_->objects()->size();
    expected.erase(root);
    found.erase(root);
    EXPECT_TRUE(expected == found) << "other cells were touched";
    return whole && expected == found;
  }
  static nlohmann::json summary_of(const Process& process) {
    return nlohmann::json::parse(process.out());
  }
  // A bake with workers of its own, with this fault.
  std::vector<std::string> faulty_bake(const std::string& fault, const std::string& workers) const {
    std::vector<std::string> command{"/usr/bin/env", "LD_PRELOAD=" PVSFARM_FAULT_PRELOAD,
                                     "PVSFARM_FAULT=" + fault};
    const auto words = bake_command(out_, {"--workers", workers});
    command.insert(command.end(), words.begin(), words.end());
    return command;
  }

  static std::unique_ptr<StoreReader> golden_store_;
  static Vec3 center_;
};
std::unique_ptr<StoreReader> PoisonTest::golden_store_;
Vec3 PoisonTest::center_{0};

}  // namespace

TEST_F(PoisonTest, a_cell_that_fails_everywhere_keeps_its_parents_set_and_the_rest_is_done) {
  const auto coordinator = coordinate();
  Crew workers = crew("worker");
  for (int i = 0; i < 4; ++i) workers.start(endpoint(), "refuse" + place(60));
  const int code = coordinator->wait();
  EXPECT_EQ(code, kIncomplete) << coordinator->err();
  ASSERT_EQ(code, kIncomplete);
  const auto summary = summary_of(*coordinator);
  EXPECT_EQ(summary["quarantined"], 1);
  const bool rest = only_poisoned(60);
  for (std::size_t i = 0; i < workers.size(); ++i)
    EXPECT_EQ(workers.process(i).wait(10), 0)
        << "blocked for a cell's fault: " << workers.process(i).err();
  record({16, "a cell that fails on every worker", "quarantined, the rest as ever, exit code 6",
          std::to_string(summary["quarantined"].get<int>()) + " quarantined, the rest " +
              (rest ? "as ever" : "DIFFERENT") + ", exit code " + std::to_string(code),
          rest && summary["quarantined"] == 1});

  // The same command tries it again, with good workers.
  Process again(bake_command(out_), log("again"));
  EXPECT_TRUE(outcome(again).well()) << again.err();
}

TEST_F(PoisonTest, a_cell_that_kills_its_worker_is_given_up_and_the_rest_is_done) {
  for (const char* workers : {"1", "2"}) {
    Process bake(faulty_bake("burst" + place(60), workers), log("bake"));
    ASSERT_EQ(bake.wait(200), kIncomplete) << bake.err();
    EXPECT_EQ(summary_of(bake)["quarantined"], 1);
    const bool rest = only_poisoned(60);
    record(
        {16, std::string("a cell that kills its worker, workers: ") + workers,
         "quarantined, the rest as ever, exit code 6",
         std::string("quarantined, the rest ") + (rest ? "as ever" : "DIFFERENT") + ", exit code 6",
         rest});
    for (const char* suffix : {"", ".stats", ".journal"}) std::filesystem::remove(out_ + suffix);
  }
}

TEST_F(PoisonTest, a_worker_that_always_crashes_spoils_no_cell) {
  const auto coordinator = coordinate();
  Crew good = crew("good"), bad = crew("bad");
  // Alone first, so often that each of its cells would have been given up, then beside a good one.
  bad.start(endpoint(), "crash 1");
  while (coordinator->running() && bad.starts() < 24) {
    bad.start_fallen();
    if (bad.starts() == 16 && good.size() == 0) good.start(endpoint(), "slow 5");
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  const Outcome result = outcome(*coordinator);
  EXPECT_TRUE(result.well()) << coordinator->err();
  record({16, "cells spoilt by a worker that crashed " + std::to_string(bad.starts()) + " times",
          "0", std::to_string(result.quarantined), result.well()});
}

TEST_F(PoisonTest, workers_that_all_crash_end_the_bake_in_plain_words) {
  const auto start = TestClock::now();
  Process bake(faulty_bake("crash 1", "2"), log("bake"));
  EXPECT_EQ(bake.wait(100), 4) << bake.err();
  EXPECT_NE(bake.err().find("no worker is left"), std::string::npos) << bake.err();
  // Not all at once: what is wrong may pass.
  EXPECT_GT(TestClock::now() - start, std::chrono::seconds(5));
  EXPECT_FALSE(std::filesystem::exists(out_));
}

}  // namespace pvsfarm

// Real processes: the same bytes whatever happens to them, and plain words when nothing can be
// done.
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/wire/socket.hpp"
#include "tests/farm/farm_fixture.hpp"

namespace pvsfarm {
namespace {

namespace fs = std::filesystem;

class FarmTest : public FarmFixture {
 protected:
  std::vector<std::string> coordinate_command() const {
    return with_scene({kPvsfarm, "coordinate", "--bind", ipc()}, out_);
  }
  std::string ipc() const { return "ipc://" + folder_ + "/farm"; }

  // Of the coordinator that works on out_.
  std::optional<StatusReport> status_of_out() const {
    const auto text = read_file(out_ + ".endpoint");
    return text ? ask_status(text->substr(0, text->find('\n'))) : std::nullopt;
  }
  bool reaches(std::uint64_t cells) const {
    return wait_until(60, [&] {
      const auto status = status_of_out();
      return status && status->cells_done >= cells;
    });
  }
  void expect_golden() const { EXPECT_TRUE(read_file(out_).value() == golden_); }
  // Of coordinators: the temporary folder of these tests is folder_.
  int private_folders() const {
    int count = 0;
    for (const auto& entry : fs::directory_iterator(folder_))
      count += entry.path().filename().string().rfind("pvsfarm-", 0) == 0 ? 1 : 0;
    return count;
  }
  bool journal_exists() const { return fs::exists(out_ + ".journal"); }
};

}  // namespace

TEST_F(FarmTest, any_number_of_workers_makes_the_same_bytes_and_leaves_nothing_behind) {
  for (const char* workers : {"2", "3"}) {
    Process bake(bake_command(out_, {"--workers", workers}), log("bake"));
    ASSERT_EQ(bake.wait(), 0) << bake.err();
    expect_golden();
    EXPECT_FALSE(journal_exists());
    EXPECT_FALSE(fs::exists(out_ + ".endpoint"));
    const auto summary = nlohmann::json::parse(bake.out());
    EXPECT_GT(summary["cells"], 200);
    EXPECT_GT(summary["cells"], summary["leaves"]);  // some were split
    EXPECT_LT(summary["coordinator_cpu_ms_per_cell"], 1.0);
    fs::remove(out_);
  }
}

TEST_F(FarmTest, hints_stand_beside_the_same_store_and_are_the_same_bytes_too) {
  std::string hints;
  for (const char* workers : {"1", "2"}) {
    Process bake(bake_command(out_, {"--workers", workers, "--hints", "8"}), log("bake"));
    ASSERT_EQ(bake.wait(), 0) << bake.err();
    expect_golden();
    const std::string bytes = read_file(out_ + ".hints").value();
    EXPECT_TRUE(hints.empty() || bytes == hints) << workers << " workers";
    hints = bytes;
    fs::remove(out_);
  }
  // A store without its hints is baked again when they are asked for, and no more after that.
  fs::copy(suite_ + "/golden.pvs", out_);
  for (const bool again : {false, true}) {
    if (!again) fs::remove(out_ + ".hints");
    Process bake(bake_command(out_, {"--hints", "8"}), log("bake"));
    ASSERT_EQ(bake.wait(), 0) << bake.err();
    EXPECT_EQ(nlohmann::json::parse(bake.out())["already_baked"], again);
    EXPECT_TRUE(read_file(out_ + ".hints").value() == hints);
  }
  const auto exported = [&](const std::vector<std::string>& more) {
    std::vector<std::string> command{kPvsfarm, "export", out_};
    command.insert(command.end(), more.begin(), more.end());
    Process process(command, log("export"));
    EXPECT_EQ(process.wait(), 0) << process.err();
    const std::string text = process.out();
    return nlohmann::json::parse(
        text.substr(text.find('\n') + 1, text.find('\n', text.find('\n') + 1) - text.find('\n')));
  };
  EXPECT_FALSE(exported({}).contains("degree"));
  const auto cell = exported({"--hints"});
  EXPECT_EQ(cell["degree"].size(), cell["visible"].size());
  EXPECT_EQ(cell["size"].size(), cell["visible"].size());
  EXPECT_EQ(cell["degree"].front().get<int>() > 0, cell["size"].front().get<int>() > 0);
}

TEST_F(FarmTest, what_is_baked_already_is_not_baked_again) {
  fs::copy(suite_ + "/golden.pvs", out_);
  Process again(bake_command(out_), log("bake"));
  EXPECT_EQ(again.wait(), 0);
  EXPECT_NE(again.err().find("already baked"), std::string::npos);
  EXPECT_TRUE(nlohmann::json::parse(again.out())["already_baked"]);
}

TEST_F(FarmTest, a_killed_worker_costs_its_lease_only) {
  Process bake(bake_command(out_), log("bake"));
  ASSERT_TRUE(reaches(60));
  const auto status = status_of_out();
  ASSERT_TRUE(status && !status->workers.empty());
  kill(static_cast<int>(status->workers[0].pid), SIGKILL);
  ASSERT_EQ(bake.wait(), 0) << bake.err();
  EXPECT_NE(bake.err().find("killed by signal 9"), std::string::npos) << bake.err();
  expect_golden();
}

TEST_F(FarmTest, a_killed_coordinator_goes_on_where_it_was) {
  {
    Process bake(bake_command(out_), log("first"));
    ASSERT_TRUE(reaches(80));
    bake.send(SIGKILL);
    ASSERT_EQ(bake.wait(), 128 + SIGKILL);
  }
  ASSERT_TRUE(journal_exists());
  EXPECT_FALSE(fs::exists(out_));
  EXPECT_EQ(private_folders(), 1);
  const std::string another = folder_ + "/pvsfarm-xxxxxx";  // not this bake's, though unlocked
  fs::create_directory(another);
  Process again(bake_command(out_), log("again"));
  ASSERT_EQ(again.wait(), 0) << again.err();
  EXPECT_TRUE(fs::remove(another));
  EXPECT_EQ(private_folders(), 0);
  EXPECT_GE(nlohmann::json::parse(again.out())["resumed"], 40);
  expect_golden();
}

TEST_F(FarmTest, the_folder_of_a_living_coordinator_is_left_alone) {
  Process bake(bake_command(out_), log("first"));
  ASSERT_TRUE(reaches(20));
  // Another bake whose record names the folder of the first, and one that names no such folder.
  const std::string other = folder_ + "/other.pvs", precious = folder_ + "/precious";
  fs::copy(out_ + ".endpoint", other + ".endpoint");
  Process second(bake_command(other), log("second"));
  fs::create_directory(precious);
  ASSERT_TRUE(write_file(folder_ + "/third.pvs.endpoint", "ipc:///none\n" + precious + "\n").ok());
  Process third(bake_command(folder_ + "/third.pvs"), log("third"));
  EXPECT_EQ(second.wait(), 0) << second.err();
  EXPECT_EQ(third.wait(), 0) << third.err();
  EXPECT_TRUE(fs::exists(precious));
  ASSERT_EQ(bake.wait(), 0) << bake.err();
  EXPECT_EQ(bake.err().find("ended"), std::string::npos) << bake.err();  // no worker died
  expect_golden();
  EXPECT_EQ(private_folders(), 0);
}

TEST_F(FarmTest, ctrl_c_keeps_the_journal_and_other_settings_do_not_get_it) {
  {
    Process bake(bake_command(out_), log("first"));
    ASSERT_TRUE(reaches(60));
    bake.send(SIGINT);
    EXPECT_EQ(bake.wait(20), 130) << bake.err();
  }
  ASSERT_TRUE(journal_exists());
  EXPECT_FALSE(fs::exists(out_));

  Process other(bake_command(out_, {"--planes", "1"}), log("other"));
  EXPECT_EQ(other.wait(), 3);
  EXPECT_NE(other.err().find("--fresh"), std::string::npos) << other.err();
  ASSERT_TRUE(journal_exists());

  Process again(bake_command(out_), log("again"));
  ASSERT_EQ(again.wait(), 0) << again.err();
  EXPECT_GE(nlohmann::json::parse(again.out())["resumed"], 60);
  expect_golden();
}

TEST_F(FarmTest, a_worker_that_never_saw_the_scene_fetches_it) {
  Process coordinate(coordinate_command(), log("coordinate"));
  ASSERT_TRUE(wait_until(60, [&] { return fs::exists(out_ + ".endpoint"); }));
  // The file that workers of this machine would map.
  std::size_t removed = 0;
  for (const auto& entry : fs::directory_iterator(folder_))
    if (entry.path().filename().string().rfind("pvsfarm-", 0) == 0)
      removed += fs::remove(entry.path() / "scene") ? 1 : 0;
  ASSERT_EQ(removed, 1u);
  Process worker({kWorker, "--connect", ipc(), "--cache", folder_ + "/cache"}, log("worker"));
  ASSERT_EQ(coordinate.wait(), 0) << coordinate.err();
  EXPECT_EQ(worker.wait(10), 0) << worker.err();  // told that it is over
  expect_golden();
  std::size_t scenes = 0;
  for (const auto& entry : fs::directory_iterator(folder_ + "/cache"))
    scenes += entry.path().extension() == ".scene" ? 1 : 0;
  EXPECT_EQ(scenes, 1u);
}

TEST_F(FarmTest, a_worker_with_another_kernel_is_rejected_within_a_second) {
  Process coordinate(coordinate_command(), log("coordinate"));
  ASSERT_TRUE(wait_until(60, [&] { return fs::exists(out_ + ".endpoint"); }));
  const auto start = TestClock::now();
  auto dealer = Dealer::connect(ipc()).value();
  Hello hello;
  hello.kernel.algorithm_version = kAlgorithmVersion + 1;
  dealer->send({}, hello);
  std::optional<Received> answer;
  ASSERT_TRUE(wait_until(5, [&] { return (answer = dealer->receive()).has_value(); }));
  EXPECT_LT(TestClock::now() - start, std::chrono::seconds(1));
  const auto* reject = std::get_if<Reject>(&answer->decoded.value().message);
  ASSERT_NE(reject, nullptr);
  EXPECT_EQ(reject->code, RejectCode::kKernel);
  for (const int version : {kAlgorithmVersion, kAlgorithmVersion + 1})
    EXPECT_NE(reject->text.find("algorithm " + std::to_string(version)), std::string::npos)
        << reject->text;
}

TEST_F(FarmTest, a_rejected_worker_asks_not_to_be_started_again) {
  const auto router = Router::bind(ipc()).value();
  Process worker({kWorker, "--connect", ipc()}, log("worker"));
  std::optional<Received> hello;
  ASSERT_TRUE(wait_until(20, [&] { return (hello = router->receive()).has_value(); }));
  router->send(hello->peer, {.epoch = 1}, Reject{RejectCode::kKernel, "this one and that one"});
  EXPECT_EQ(worker.wait(10), 42);
  EXPECT_NE(worker.err().find("this one and that one"), std::string::npos);
}

TEST_F(FarmTest, a_worker_without_a_coordinator_leaves_and_may_be_started_again) {
  Process worker({kWorker, "--connect", ipc(), "--max-idle", "0.3"}, log("worker"));
  EXPECT_EQ(worker.wait(10), 75) << worker.err();
}

TEST_F(FarmTest, sigterm_lets_a_worker_finish_and_another_takes_over) {
  Process coordinate(coordinate_command(), log("coordinate"));
  Process first({kWorker, "--connect", ipc(), "--cache", log("cache")}, log("one"));
  ASSERT_TRUE(reaches(20));
  first.send(SIGTERM);
  EXPECT_EQ(first.wait(25), 0) << first.err();
  Process second({kWorker, "--connect", ipc(), "--cache", log("cache")}, log("two"));
  ASSERT_EQ(coordinate.wait(), 0) << coordinate.err();
  EXPECT_EQ(coordinate.err().find("lost"), std::string::npos) << coordinate.err();
  expect_golden();
}

TEST_F(FarmTest, drain_stops_a_bake_with_its_journal) {
  Process bake(bake_command(out_), log("bake"));
  ASSERT_TRUE(reaches(20));
  Process drain({kPvsfarm, "drain", out_}, log("drain"));
  EXPECT_EQ(drain.wait(10), 0) << drain.err();
  EXPECT_EQ(bake.wait(20), 130);
  EXPECT_TRUE(journal_exists());
  Process status({kPvsfarm, "status", out_}, log("status"));
  EXPECT_EQ(status.wait(10), 4);  // nobody is at work any more
}

TEST_F(FarmTest, an_output_that_cannot_be_written_is_said_before_any_work) {
  for (const std::string& out : {folder_ + "/no/such/out.pvs", std::string("/proc/out.pvs")}) {
    Process bake(bake_command(out), log("bake"));
    EXPECT_EQ(bake.wait(30), 2) << bake.err();
    EXPECT_TRUE(bake.out().empty());
  }
}

TEST_F(FarmTest, addresses_off_this_machine_are_refused) {
  Process open(with_scene({kPvsfarm, "coordinate", "--bind", "tcp://0.0.0.0:5555"}, out_, {}),
               log("open"));
  EXPECT_EQ(open.wait(30), 5) << open.err();
}

}  // namespace pvsfarm

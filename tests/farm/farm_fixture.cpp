#include "tests/farm/farm_fixture.hpp"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/wire/socket.hpp"

namespace pvsfarm {
namespace fs = std::filesystem;

std::optional<StatusReport> ask_status(const std::string& endpoint) {
  auto dealer = Dealer::connect(endpoint);
  if (!dealer) return std::nullopt;
  (*dealer)->send({}, StatusGet{});
  const auto end = TestClock::now() + std::chrono::milliseconds(500);
  while (TestClock::now() < end) {
    if (const auto received = (*dealer)->receive())
      return received->decoded ? std::optional(std::get<StatusReport>(received->decoded->message))
                               : std::nullopt;
    (*dealer)->wait(std::chrono::milliseconds(20));
  }
  return std::nullopt;
}

void Crew::run(Member& member) {
  member.process =
      std::make_unique<Process>(member.command, log_ + "-" + std::to_string(starts_++));
}

std::size_t Crew::start(const std::string& endpoint, const std::string& fault,
                        const std::vector<std::string>& more) {
  Member member;
  if (!fault.empty())
    member.command = {"/usr/bin/env", "LD_PRELOAD=" PVSFARM_FAULT_PRELOAD,
                      "PVSFARM_FAULT=" + fault};
  member.command.insert(member.command.end(), {kWorker, "--connect", endpoint, "--cache", cache_});
  member.command.insert(member.command.end(), more.begin(), more.end());
  run(member);
  members_.push_back(std::move(member));
  return members_.size() - 1;
}

bool Crew::start_fallen() {
  bool any = false;
  for (Member& member : members_) {
    if (member.process->running()) continue;
    const int code = member.process->wait(0);
    if (code == 0 || code == 42) continue;
    run(member);
    any = true;
  }
  return any;
}

std::string FarmFixture::suite_, FarmFixture::golden_;
std::int64_t FarmFixture::golden_cells_ = 0;

void FarmFixture::SetUpTestSuite() {
  std::string pattern = testing::TempDir() + "farm-XXXXXX";
  suite_ = mkdtemp(pattern.data());
  Process generate({kPvsfarm, "generate", "city", "--blocks", "2", "--cell-size", "8", "-o",
                    suite_ + "/city.obj"},
                   suite_ + "/generate");
  ASSERT_EQ(generate.wait(), 0) << generate.err();
  Process bake(bake_command(suite_ + "/golden.pvs", {"--workers", "1"}), suite_ + "/golden");
  ASSERT_EQ(bake.wait(300), 0) << bake.err();
  golden_ = read_file(suite_ + "/golden.pvs").value();
  golden_cells_ = nlohmann::json::parse(bake.out())["evaluated"];
  ASSERT_GE(golden_cells_, 500);
}

void FarmFixture::TearDownTestSuite() { fs::remove_all(suite_); }

void FarmFixture::SetUp() {
  ASSERT_FALSE(golden_.empty()) << "there is no golden store";  // a skipped test would hide it
  std::string pattern = suite_ + "/t-XXXXXX";
  folder_ = mkdtemp(pattern.data());
  setenv("TMPDIR", folder_.c_str(), 1);
  out_ = folder_ + "/city.pvs";
}

void FarmFixture::TearDown() { fs::remove_all(folder_); }

std::vector<std::string> FarmFixture::with_scene(std::vector<std::string> command,
                                                 const std::string& out,
                                                 const std::vector<std::string>& more) {
  for (const char* word : {"--cells", "/city.cells.json", "--tags", "/city.tags.json"})
    command.push_back(*word == '/' ? suite_ + word : word);
  const std::vector<std::string> rest{suite_ + "/city.obj", "-o",  out,          "--json",
                                      "--budget",           "605", "--min-cell", "0.7"};
  command.insert(command.end(), rest.begin(), rest.end());
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

std::vector<std::string> FarmFixture::bake_command(const std::string& out,
                                                   const std::vector<std::string>& more) {
  return with_scene({kPvsfarm, "bake"}, out, more);
}

std::unique_ptr<Process> FarmFixture::coordinate(const std::vector<std::string>& more,
                                                 const std::string& bind) {
  for (const char* suffix : {"", ".stats", ".journal", ".journal-wal", ".endpoint"})
    fs::remove(out_ + suffix);
  auto process = std::make_unique<Process>(
      with_scene({kPvsfarm, "coordinate", "--bind", bind}, out_, more), log("coordinator"));
  await_endpoint(*process);
  return process;
}

void FarmFixture::await_endpoint(Process& coordinator, double limit_s) {
  const bool listens = wait_until(limit_s, [&] {
    const auto text = read_file(out_ + ".endpoint");
    if (text) endpoint_ = text->substr(0, text->find('\n'));
    return text.ok() || !coordinator.running();
  });
  EXPECT_TRUE(listens && coordinator.running()) << coordinator.err();
}

std::uint64_t FarmFixture::hide_scene() const {
  std::uint64_t bytes = 0;
  for (const auto& entry : fs::directory_iterator(folder_)) {
    const fs::path scene = entry.path() / "scene";
    if (entry.path().filename().string().rfind("pvsfarm-", 0) != 0 || !fs::exists(scene)) continue;
    bytes = fs::file_size(scene);
    fs::rename(scene, hidden_scene());
  }
  return bytes;
}

std::uint64_t FarmFixture::cells_done() const {
  const auto report = status();
  return report ? report->cells_done : 0;
}

bool FarmFixture::reaches(std::uint64_t cells, double limit_s) const {
  return wait_until(limit_s, [&] { return cells_done() >= cells; });
}

FarmFixture::Outcome FarmFixture::outcome(Process& coordinator, double limit_s) const {
  Outcome outcome;
  const auto done_so_far = [&] {
    std::optional<StatusReport> report;
    wait_until(30, [&] { return (report = status()) || !coordinator.running(); });
    return report ? report->cells_done : 0;
  };
  int code = -1;
  for (bool advances = true; code < 0 && advances;) {
    const std::uint64_t before = done_so_far();
    code = coordinator.wait(limit_s);
    advances = code < 0 && done_so_far() > before;
  }
  EXPECT_EQ(code, 0) << coordinator.err();
  outcome.finished = code == 0;
  if (code != 0 && code != 6) {
    outcome.lost = golden_cells_;
    return outcome;
  }
  const auto summary = nlohmann::json::parse(coordinator.out());
  const std::int64_t now = summary["evaluated"], before = summary["resumed"];
  const std::int64_t merged = now + before;
  outcome.lost = std::max<std::int64_t>(golden_cells_ - merged, 0);
  outcome.twice = std::max<std::int64_t>(merged - golden_cells_, 0);
  outcome.quarantined = summary["quarantined"];
  outcome.disagreements = summary["disagreements"];
  outcome.identical = read_file(out_).value() == golden_;
  return outcome;
}

}  // namespace pvsfarm

// Watching a bake and steering it: status, pause, figures over HTTP, trace, log, manners of
// workers.
#include <sys/resource.h>
#include <sys/syscall.h>

#include <cmath>
#include <filesystem>
#include <iomanip>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/farm/farm_fixture.hpp"
#include "tests/farm/http_get.hpp"
#include "tests/support/bake_trace.hpp"
#include "tests/support/fault_figures.hpp"
#include "tests/support/prometheus_text.hpp"

namespace pvsfarm {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kSlow = "slow 3";  // fault_preload.cpp; a tenth of a second a cell

class OperationsTest : public FarmFixture {
 protected:
  json status_json() const {
    Process status({kPvsfarm, "status", endpoint(), "--json"}, log("status"));
    EXPECT_EQ(status.wait(20), 0) << status.err();
    return json::parse(status.out());
  }
  void command(const std::string& name) const {
    Process process({kPvsfarm, name, endpoint()}, log(name));
    EXPECT_EQ(process.wait(20), 0) << process.err();
  }
  // Of a coordinator that is there, however busy the machine is.
  StatusReport answered() const {
    std::optional<StatusReport> report;
    EXPECT_TRUE(wait_until(60, [&] { return (report = status()).has_value(); }));
    return report.value_or(StatusReport{});
  }
  // A bake that is looked at must not end before the test has looked, on whatever machine: its
  // worker sleeps at every cell. It is joined by a quick one when the bake may end.
  void start_slow(Crew& workers) const {
    workers.start(endpoint(), kSlow);
    ASSERT_TRUE(reaches(1));
  }
  Outcome let_it_end(Process& coordinator, Crew& workers) const {
    workers.start(endpoint());
    return outcome(coordinator);
  }
  // Of `--metrics` with port 0: what it says on stderr.
  static std::string url_in(const std::string& text) {
    const std::size_t at = text.find("http://127.0.0.1:");
    return at == std::string::npos ? "" : text.substr(at, text.find("/metrics", at) - at);
  }
};

std::vector<json> lines_of(const std::string& text) {
  std::vector<json> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(json::parse(line));
  return lines;
}

}  // namespace

TEST_F(OperationsTest, a_status_says_who_computes_what) {
  const auto coordinator = coordinate();
  Crew workers = crew("worker");
  start_slow(workers);
  json found;
  ASSERT_TRUE(wait_until(60, [&] {
    found = status_json();
    return found["workers"].size() == 1 && found["workers"][0]["state"] == "computing" &&
           found["counters"]["commits"] > 0;
  })) << found;
  const json& worker = found["workers"][0];
  EXPECT_EQ(worker["pid"], workers.process(0).pid());
  EXPECT_NE(worker["version"].get<std::string>().find("pvsfarm-worker"), std::string::npos);
  EXPECT_EQ(worker["running"].get<std::string>().rfind("cell ", 0), 0u) << worker;
  EXPECT_GE(worker["running_cells"], 1);
  EXPECT_LT(worker["running_ms"], worker["connected_ms"]);
  EXPECT_GT(worker["cells_done"], 0);
  EXPECT_GT(worker["resident_bytes"], 1'000'000);
  EXPECT_GT(found["journal_bytes"], 0);
  EXPECT_EQ(found["counters"]["workers_joined"], 1);
  EXPECT_EQ(found["state"], "running");

  Process text({kPvsfarm, "status", endpoint()}, log("text"));
  ASSERT_EQ(text.wait(20), 0);
  EXPECT_NE(text.out().find(":" + std::to_string(workers.process(0).pid())), std::string::npos);
  Process watch({kPvsfarm, "status", out_, "--watch", "--every", "0.2", "--json"}, log("watch"));
  ASSERT_TRUE(wait_until(60, [&] {  // it has begun
    const auto text = read_file(log("watch.out"));
    return text.ok() && text->find('\n') != std::string::npos;
  }));
  EXPECT_TRUE(let_it_end(*coordinator, workers).well());
  EXPECT_EQ(watch.wait(20), 0);  // ends with the bake
  const std::vector<json> seen = lines_of(watch.out());
  ASSERT_FALSE(seen.empty());
  EXPECT_LE(seen.front()["cells_done"], seen.back()["cells_done"]);
}

TEST_F(OperationsTest, a_pause_keeps_workers_and_hands_out_nothing) {
  const auto coordinator = coordinate();
  Crew workers = crew("worker");
  start_slow(workers);
  command("pause");
  StatusReport paused;
  // Nor with a worker that is thought lost and will come back with what it has.
  ASSERT_TRUE(wait_until(60, [&] {
    paused = answered();
    return paused.cells_leased == 0 && paused.workers.size() == 1 &&
           paused.workers[0].state == "idle";
  }));
  EXPECT_EQ(paused.state, "paused");
  EXPECT_GT(paused.cells_open, 0u);
  EXPECT_EQ(paused.workers.size(), 1u);
  std::this_thread::sleep_for(std::chrono::milliseconds(2500));  // past a heartbeat
  EXPECT_EQ(answered().cells_done, paused.cells_done);
  command("resume");
  EXPECT_TRUE(let_it_end(*coordinator, workers).well());
}

TEST_F(OperationsTest, figures_and_health_over_http) {
  const auto coordinator = coordinate({"--metrics", "0"});
  const std::string url = url_in(coordinator->err());
  ASSERT_FALSE(url.empty()) << coordinator->err();
  Crew workers = crew("worker");
  start_slow(workers);
  HttpAnswer answer;
  PrometheusText figures;
  ASSERT_TRUE(wait_until(60, [&] {
    answer = http_get(url + "/metrics");
    figures = read_prometheus(answer.body);
    return figures.values.count("pvsfarm_cells{state=\"done\"}") != 0 &&
           figures.values["pvsfarm_cells{state=\"done\"}"] >= 1 &&
           figures.values["pvsfarm_workers_resident_bytes"] > 0;  // a heartbeat later
  })) << answer.body;
  EXPECT_EQ(answer.status, 200);
  EXPECT_NE(answer.head.find("text/plain; version=0.0.4"), std::string::npos) << answer.head;
  EXPECT_EQ(figures.errors, std::vector<std::string>{});
  EXPECT_EQ(figures.values["pvsfarm_cell_cpu_seconds_count"],
            figures.values["pvsfarm_cells_evaluated_total"]);
  EXPECT_GT(figures.values["pvsfarm_workers_resident_bytes"], 1e6);
  EXPECT_EQ(http_get(url + "/healthz").status, 200);
  EXPECT_EQ(http_get(url + "/readyz").status, 200);
  EXPECT_EQ(http_get(url + "/etc/passwd").status, 404);
  EXPECT_EQ(http_get(url + "/metrics", "POST").status, 405);
  EXPECT_TRUE(let_it_end(*coordinator, workers).well());
  EXPECT_EQ(http_get(url + "/healthz").status, 0);  // gone with the coordinator
}

TEST_F(OperationsTest, metrics_where_another_listens_end_the_bake_before_it_begins) {
  const auto first = coordinate({"--metrics", "127.0.0.1:0"});
  const std::string url = url_in(first->err());
  for (const auto& [address, code] : {std::pair<std::string, int>{url.substr(7), 2},
                                      {"nowhere", 1},
                                      {"127.0.0.1", 1},
                                      {"300.0.0.1:80", 1}}) {
    Process second(bake_command(folder_ + "/b.pvs", {"--metrics", address}), log("second"));
    EXPECT_EQ(second.wait(20), code) << address << ": " << second.err();
  }
}

TEST_F(OperationsTest, a_trace_has_every_cell_once_and_no_worker_does_two_things_at_a_time) {
  const auto coordinator = coordinate({"--trace", log("trace.json")});
  Crew workers = crew("worker");
  start_slow(workers);
  EXPECT_TRUE(let_it_end(*coordinator, workers).well());
  const json events = json::parse(read_file(log("trace.json")).value());  // all of it is JSON
  std::map<int, double> free_us;
  std::map<std::string, int> cells;
  int commits = 0, counters = 0;
  for (const json& event : events) {
    const std::string phase = event["ph"];
    counters += phase == "C" ? 1 : 0;
    if (phase != "X") continue;
    const double begin = event["ts"], end = begin + event["dur"].get<double>();
    EXPECT_GE(begin, free_us[event["tid"]]) << event;
    free_us[event["tid"]] = end;
    commits += event["name"] == "commit" ? 1 : 0;
    if (event["args"].contains("cells"))
      for (const json& cell : event["args"]["cells"]) ++cells[cell["cell"]];
  }
  EXPECT_EQ(cells.size(), static_cast<std::size_t>(golden_cells_));
  for (const auto& [cell, times] : cells) EXPECT_EQ(times, 1) << cell;
  EXPECT_GT(commits, 1);
  EXPECT_GT(counters, 2);
  EXPECT_EQ(free_us.size(), 3u);  // two workers and the journal
}

TEST_F(OperationsTest, the_trace_of_a_killed_bake_opens_too) {
  const auto coordinator = coordinate({"--trace", log("trace.json")});
  Crew workers = crew("worker");
  start_slow(workers);
  ASSERT_TRUE(wait_until(60, [&] {
    const auto trace = read_bake_trace(log("trace.json"));
    return trace.ok() && trace->cells.size() > 1;
  }));
  coordinator->send(SIGKILL);
  EXPECT_EQ(coordinator->wait(10), 128 + SIGKILL);
  const auto trace = read_bake_trace(log("trace.json"));
  ASSERT_TRUE(trace.ok()) << trace.error().text;
  EXPECT_FALSE(trace->finished);
  EXPECT_GT(trace->cells.size(), 1u);
}

TEST_F(OperationsTest, every_line_of_a_json_log_is_an_object_and_says_what_it_is_about) {
  const auto coordinator = coordinate({"--log-format", "json"});
  Crew workers = crew("worker");
  start_slow(workers);
  workers.kill(0);
  const std::string pid = std::to_string(workers.process(0).pid());
  EXPECT_TRUE(let_it_end(*coordinator, workers).well());
  std::map<std::string, json> by_event;
  for (const json& line : lines_of(coordinator->err())) {
    for (const char* member : {"time", "level", "program", "event", "text"})
      EXPECT_TRUE(line.contains(member)) << line;
    EXPECT_EQ(line["time"].get<std::string>().back(), 'Z') << line;
    by_event.emplace(line["event"], line);
  }
  ASSERT_TRUE(by_event.count("worker_lost") == 1) << coordinator->err();
  const json lost = by_event["worker_lost"];
  EXPECT_EQ(lost["level"], "warning");
  const std::string name = lost["worker"];
  EXPECT_EQ(name.substr(name.rfind(':') + 1), pid);
  EXPECT_EQ(by_event.count("worker_joined"), 1u);

  Process missing({kPvsfarm, "bake", "none.obj", "-o", out_, "--log-format", "json"}, log("none"));
  EXPECT_EQ(missing.wait(20), 3);
  const std::vector<json> said = lines_of(missing.err());
  ASSERT_FALSE(said.empty());
  EXPECT_EQ(said.back()["event"], "failed");
  EXPECT_EQ(said.back()["level"], "error");
}

TEST_F(OperationsTest, workers_of_low_priority_step_back) {
  const auto coordinator = coordinate();
  command("pause");  // or the bake may end before it is looked at
  Crew workers = crew("worker");
  workers.start(endpoint(), "", {"--low-priority"});
  const pid_t pid = workers.process(0).pid();
  // The thread that computes, and it alone: the one that answers the coordinator is not among them.
  const auto idle_threads = [&] {
    int idle = 0;
    std::error_code gone;
    for (const auto& thread :
         fs::directory_iterator("/proc/" + std::to_string(pid) + "/task", gone)) {
      const auto id = static_cast<pid_t>(std::stoi(thread.path().filename().string()));
      idle += id != pid && sched_getscheduler(id) == SCHED_IDLE ? 1 : 0;
    }
    return idle;
  };
  EXPECT_TRUE(wait_until(60, [&] { return idle_threads() == 1; })) << idle_threads();
  EXPECT_NE(sched_getscheduler(pid), SCHED_IDLE);
  EXPECT_EQ(getpriority(PRIO_PROCESS, static_cast<id_t>(pid)), 19);
  EXPECT_EQ(syscall(SYS_ioprio_get, 1, pid) >> 13, 3);  // idle
  command("resume");
  // On a machine that is never idle the one gets nowhere.
  EXPECT_TRUE(let_it_end(*coordinator, workers).well());
}

TEST_F(OperationsTest, a_bake_of_low_priority_lowers_its_workers_and_not_the_user) {
  const int before = getpriority(PRIO_PROCESS, 0);
  std::vector<std::string> slow_bake{"/usr/bin/env", "LD_PRELOAD=" PVSFARM_FAULT_PRELOAD,
                                     std::string("PVSFARM_FAULT=") + kSlow};
  for (const std::string& word : bake_command(out_, {"--low-priority", "--workers", "auto"}))
    slow_bake.push_back(word);
  Process bake(slow_bake, log("bake"));
  std::optional<StatusReport> report;
  ASSERT_TRUE(wait_until(60, [&] {
    const auto text = read_file(out_ + ".endpoint");
    report = text ? ask_status(text->substr(0, text->find('\n'))) : std::nullopt;
    return report && !report->workers.empty();
  })) << bake.err();
  EXPECT_LE(report->workers.size(), static_cast<std::size_t>(sysconf(_SC_NPROCESSORS_ONLN)));
  const auto pid = static_cast<pid_t>(report->workers.at(0).pid);
  EXPECT_EQ(getpriority(PRIO_PROCESS, static_cast<id_t>(pid)), 19);
  EXPECT_EQ(getsid(pid), pid);  // weighed by itself
  EXPECT_EQ(getpriority(PRIO_PROCESS, static_cast<id_t>(bake.pid())), before);
  Process cancel({kPvsfarm, "cancel", out_}, log("cancel"));
  EXPECT_EQ(cancel.wait(20), 0) << cancel.err();
  EXPECT_EQ(bake.wait(30), 130) << bake.err();
}

TEST_F(OperationsTest, a_worker_short_of_memory_fails_tasks_and_does_not_crash) {
  const auto coordinator = coordinate();
  Crew workers = crew("worker");
  workers.start(endpoint(), "", {"--memory-limit", "64"});
  ASSERT_TRUE(wait_until(60, [&] {
    const auto report = status();
    return report && report->counters.failed_resource > 0;
  })) << workers.process(0).err();
  EXPECT_NE(coordinator->err().find("out of memory"), std::string::npos) << coordinator->err();
  workers.start(endpoint());
  EXPECT_TRUE(outcome(*coordinator).well());
  const int code = workers.process(0).wait(20);
  EXPECT_TRUE(code == 0 || code == 42) << code << workers.process(0).err();  // it left by itself
}

namespace {

// A bake of which nobody knows beforehand which cells split.
struct EstimatedBake {
  std::string name;
  std::vector<std::string> scene, cells;
};
const std::vector<EstimatedBake> kEstimatedBakes{
    {"city", {"--blocks", "4", "--cell-size", "20"}, {"--budget", "2200", "--min-cell", "2.5"}},
    {"forest",
     {"--trees", "500", "--leaves", "200", "--cell-size", "8"},
     {"--budget", "40000", "--min-cell", "1.5"}}};

// What is left is told within 30 % once a fifth of the time is over, and near the end within 3 % of
// the whole.
void expect_well_told(const TracedBake& bake, const std::string& what) {
  EXPECT_GT(bake.cells.size(), 10 * bake.root_cells);  // most are there by splitting
  double worst = 0;  // of what is left, where it is more than that of the whole
  bool held = true;
  for (const std::size_t workers : {1u, 2u, 16u}) {
    const auto told = replay_estimate(baked_by({.workers = workers}, bake), 1000);
    for (const EtaSample& sample : told) {
      const double off_s = std::abs(sample.told.eta_s - sample.left_s);
      const bool counts = sample.done >= 0.2 && off_s > 0.03 * (sample.time_s + sample.left_s);
      if (counts) worst = std::max(worst, off_s / sample.left_s);
    }
    const auto off = first_beyond(told);
    held = held && !off;
    if (off)
      ADD_FAILURE() << what << ", " << workers << " workers: after " << 100 * off->done
                    << " % of the time, " << off->left_s << " s before the end, told "
                    << off->told.eta_s << " s";
  }
  std::ostringstream percent;
  percent << std::setprecision(2) << 100 * worst << " %";
  record({.row = 28,
          .what = what + ", " + std::to_string(bake.cells.size()) + " cells, 1, 2 and 16 workers",
          .asked = "30 %, or 3 % of the whole",
          .reached = percent.str(),
          .held = held});
}

}  // namespace

// From what the cells of two bakes cost once: the same on every machine, however busy.
TEST_F(OperationsTest, the_time_left_is_told_right_in_a_city_and_in_a_forest) {
  for (const EstimatedBake& known : kEstimatedBakes) {
    const auto bake = read_cell_costs(PVSFARM_ESTIMATES "/" + known.name + ".cells");
    ASSERT_TRUE(bake.ok()) << bake.error().text;
    expect_well_told(*bake, known.name + " as it was kept");
  }
}

// The same bakes, now and here. Their traces are what estimates/record.py keeps.
TEST_F(OperationsTest, the_time_left_is_told_right_of_bakes_of_today) {
  if (!full_counts()) GTEST_SKIP() << "minutes; PVSFARM_FULL=1";
  for (const EstimatedBake& today : kEstimatedBakes) {
    SCOPED_TRACE(today.name);
    const std::string base = log(today.name);
    std::vector<std::string> make{kPvsfarm, "generate", today.name, "-o", base + ".obj"};
    make.insert(make.end(), today.scene.begin(), today.scene.end());
    Process generate(make, log("generate"));
    ASSERT_EQ(generate.wait(), 0) << generate.err();
    std::vector<std::string> command{kPvsfarm, "bake", base + ".obj", "-o", base + ".pvs"};
    for (const std::string& word :
         {std::string("--cells"), base + ".cells.json", std::string("--tags"), base + ".tags.json",
          std::string("--split-gain"), std::string("0"), std::string("--trace"), base + ".json"})
      command.push_back(word);
    command.insert(command.end(), today.cells.begin(), today.cells.end());
    Process bake(command, log("bake"));
    ASSERT_EQ(bake.wait(3500), 0) << bake.err();
    const auto trace = read_bake_trace(base + ".json");
    ASSERT_TRUE(trace.ok()) << trace.error().text;
    EXPECT_TRUE(trace->finished);
    expect_well_told(*trace, today.name + " of today");
  }
}

}  // namespace pvsfarm

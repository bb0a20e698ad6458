// The text that Prometheus reads, by the rules that promtool checks it with; and the page that
// lists the metrics.
#include "coordinator/metrics/metrics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "common/base/file.hpp"
#include "tests/support/prometheus_text.hpp"

namespace pvsfarm {
namespace {

StatusReport some_status() {
  StatusReport report{.output = "a.pvs", .state = "running", .cells_done = 100, .cells_open = 20};
  report.cells_leased = 5;
  report.cells_resumed = 40;
  report.cells_expected = 150.5;
  report.counters = {.results = 30, .duplicates = 2, .resends = 1, .splits = 9};
  report.cell_seconds[0] = 10, report.cell_seconds[3] = 49, report.cell_seconds.back() = 1;
  report.cpu_s = 400.25;
  report.workers.resize(3);
  report.workers[0].state = report.workers[1].state = "computing";
  report.workers[2].state = "suspect";
  report.workers[2].silent_ms = 12'500;
  return report;
}

}  // namespace

TEST(Metrics, prometheus_understands_them) {
  const PrometheusText text = read_prometheus(metrics_text(some_status(), {1.5, 1e9, 1 << 20}));
  EXPECT_EQ(text.errors, std::vector<std::string>{});
  EXPECT_EQ(text.values.at("pvsfarm_cells{state=\"done\"}"), 100);
  EXPECT_EQ(text.values.at("pvsfarm_cells{state=\"pending\"}"), 15);
  EXPECT_EQ(text.values.at("pvsfarm_cells_evaluated_total"), 60);
  EXPECT_EQ(text.values.at("pvsfarm_results_total{outcome=\"merged\"}"), 28);
  EXPECT_EQ(text.values.at("pvsfarm_workers{state=\"computing\"}"), 2);
  EXPECT_EQ(text.values.at("pvsfarm_worker_silent_seconds_max"), 12.5);
  EXPECT_EQ(text.values.at("pvsfarm_cell_cpu_seconds_bucket{le=\"0.03\"}"), 59);
  EXPECT_EQ(text.values.at("pvsfarm_cell_cpu_seconds_bucket{le=\"+Inf\"}"), 60);
  EXPECT_EQ(text.values.at("pvsfarm_cell_cpu_seconds_count"), 60);
  EXPECT_EQ(text.values.at("pvsfarm_state{state=\"running\"}"), 1);
  EXPECT_EQ(text.values.at("pvsfarm_state{state=\"paused\"}"), 0);
}

TEST(Metrics, an_eta_that_is_not_known_is_left_out) {
  StatusReport report = some_status();
  EXPECT_EQ(read_prometheus(metrics_text(report, {})).values.count("pvsfarm_eta_seconds"), 0u);
  report.eta_s = 12;
  EXPECT_EQ(read_prometheus(metrics_text(report, {})).values.at("pvsfarm_eta_seconds"), 12);
}

TEST(Metrics, names_follow_the_conventions) {
  std::set<std::string_view> names;
  for (const Metric& metric : all_metrics()) {
    EXPECT_TRUE(names.insert(metric.name).second) << metric.name;
    const bool total =
        metric.name.size() > 6 && metric.name.substr(metric.name.size() - 6) == "_total";
    EXPECT_EQ(total, metric.type == "counter") << metric.name;
    EXPECT_TRUE(metric.name.rfind("pvsfarm_", 0) == 0 || metric.name.rfind("process_", 0) == 0);
    for (const char* unit : {"_ms", "_millis", "_mib", "_kb", "_percent"})
      EXPECT_EQ(metric.name.find(unit), std::string_view::npos) << metric.name << ": base units";
  }
}

// The page says of every metric what the program says, and of no other.
TEST(Metrics, the_manual_lists_them_all) {
  std::istringstream page(read_file(PVSFARM_SOURCE_DIR "/docs/operating.md").value());
  std::vector<std::string> rows, expected;
  for (std::string line; std::getline(page, line);)
    if (line.rfind("| `pvsfarm_", 0) == 0 || line.rfind("| `process_", 0) == 0)
      rows.push_back(line);
  for (const Metric& metric : all_metrics())
    expected.push_back("| `" + std::string(metric.name) + "` | " + std::string(metric.type) +
                       " | " + std::string(metric.help) + " |");
  std::string wanted;
  for (const std::string& row : expected) wanted += row + '\n';
  EXPECT_EQ(rows, expected) << "docs/operating.md should say:\n" << wanted;
}

// A checker that finds nothing wrong with anything would be no use.
TEST(Metrics, the_checker_finds_what_is_wrong) {
  const std::string head = "# HELP a_total X.\n# TYPE a_total counter\n";
  EXPECT_TRUE(read_prometheus(head + "a_total 1\n").errors.empty());
  for (const std::string& wrong :
       {head + "a_total 1", head + "a_total\n", head + "a_total x\n", head + "a_total -1\n",
        head + "a_total{b} 1\n", head + "a_total{b=\"c} 1\n", head + "a_total 1\na_total 2\n",
        head + "b_total 1\n", std::string("# TYPE a_total counter\na_total 1\n"),
        std::string("a_total 1\n"), head + head + "a_total 1\n",
        std::string("# HELP a X.\n# TYPE a counter\na 1\n"),
        std::string("# HELP h X.\n# TYPE h histogram\nh_bucket{le=\"1\"} 2\nh_bucket{le=\"+Inf\"} "
                    "1\nh_sum 1\nh_count 1\n"),
        std::string("# HELP h X.\n# TYPE h histogram\nh_bucket{le=\"1\"} 1\nh_sum 1\nh_count "
                    "1\n")})
    EXPECT_FALSE(read_prometheus(wrong).errors.empty()) << wrong;
}

}  // namespace pvsfarm

// A running bake's figures as Prometheus' text format 0.0.4.
// docs/operating.md has the table of them; a test holds the two together.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "common/wire/messages.hpp"

namespace pvsfarm {

struct Metric {
  std::string_view name, type, help;  // "pvsfarm_eta_seconds", "gauge", one sentence
};
// All there are, in the order of the text.
std::span<const Metric> all_metrics();

struct ProcessFigures {
  double cpu_s = 0;
  double start_time_s = 0;  // since 1970
  std::uint64_t resident_bytes = 0;
};
ProcessFigures process_figures();

// What is not known (an ETA before the first cell) is left out.
std::string metrics_text(const StatusReport& report, const ProcessFigures& process);

}  // namespace pvsfarm

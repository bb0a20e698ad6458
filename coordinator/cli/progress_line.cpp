#include "coordinator/cli/progress_line.hpp"

#include <cmath>
#include <cstdio>
#include <iostream>

#include "common/base/log.hpp"
#include "coordinator/cli/text.hpp"

namespace pvsfarm {
namespace {
constexpr std::uint64_t kLineEveryMs = 10'000;

template <class... Arguments>
std::string format(const char* pattern, Arguments... arguments) {
  char text[128];
  std::snprintf(text, sizeof text, pattern, arguments...);
  return text;
}
}  // namespace

std::string duration_text(double seconds) {
  if (seconds < 60) return format("%.1f s", seconds);
  const auto whole = static_cast<long long>(std::llround(seconds));
  if (whole < 3600) return format("%lld min %02lld s", whole / 60, whole % 60);
  return format("%lld h %02lld min", whole / 3600, whole / 60 % 60);
}

std::string progress_text(const StatusReport& report) {
  const auto done = static_cast<double>(report.cells_done);
  const double share = report.cells_expected > 0 ? 100 * done / report.cells_expected : 0;
  std::string text =
      format("%llu of about %.0f cells (%.0f %%)",
             static_cast<unsigned long long>(report.cells_done), report.cells_expected, share);
  if (report.cells_per_second > 0) text += format(", %.1f cells/s", report.cells_per_second);
  if (report.eta_s >= 0) text += ", " + duration_text(report.eta_s) + " left";
  text += ", " + bytes_text(report.result_bytes);
  text += format(", %zu worker%s", report.workers.size(), report.workers.size() == 1 ? "" : "s");
  return text;
}

void ProgressLine::show(const StatusReport& report) {
  show_text(progress_text(report), report.elapsed_ms);
}

void ProgressLine::show_text(const std::string& text, std::uint64_t elapsed_ms) {
  if (options_.quiet) return;
  if (options_.terminal) {
    std::cerr << "\r\033[K" << text << std::flush;
    drawn_ = true;
    return;
  }
  if (elapsed_ms < next_ms_) return;
  next_ms_ = elapsed_ms / kLineEveryMs * kLineEveryMs + kLineEveryMs;
  log_info(text);
}

void ProgressLine::clear() {
  if (drawn_) std::cerr << "\r\033[K" << std::flush;
  drawn_ = false;
}

}  // namespace pvsfarm

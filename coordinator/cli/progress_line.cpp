#include "coordinator/cli/progress_line.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>

#include "common/base/log.hpp"
#include "coordinator/cli/text.hpp"

namespace pvsfarm {
namespace {
constexpr std::uint64_t kLineEveryMs = 10'000;
constexpr double kOneFigure = 1.3;  // a range narrower than this factor is told as one figure

template <class... Arguments>
std::string format(const char* pattern, Arguments... arguments) {
  char text[128];
  std::snprintf(text, sizeof text, pattern, arguments...);
  return text;
}

// Of the terminal on stderr; 80 where it does not say.
std::size_t columns() {
  winsize size{};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

std::string speed_text(double cells_per_second) {
  if (cells_per_second >= 10) return format("%.0f cells/s", cells_per_second);
  if (cells_per_second >= 0.1) return format("%.1f cells/s", cells_per_second);
  return format("%.1f cells/min", 60 * cells_per_second);
}

}  // namespace

std::string duration_text(double seconds) {
  if (seconds < 60) return format("%.1f s", seconds);
  const auto whole = static_cast<long long>(std::llround(seconds));
  if (whole < 3600) return format("%lld min %02lld s", whole / 60, whole % 60);
  return format("%lld h %02lld min", whole / 3600, whole / 60 % 60);
}

std::string rough_duration(double seconds) {
  if (seconds < 90) return format("%.0f s", seconds < 20 ? seconds : 5 * std::round(seconds / 5));
  if (seconds < 90 * 60) return format("%.0f min", seconds / 60);
  if (seconds < 36 * 3600) return format("%.1f h", seconds / 3600);
  return format("%.1f days", seconds / 86'400);
}

std::string time_left(const StatusReport& report) {
  if (report.eta_s < 0) return "time left not known yet";
  const std::string low = rough_duration(report.eta_low_s),
                    high = rough_duration(report.eta_high_s);
  if (report.eta_high_s < 0) return "at least " + low + " left";
  if (report.eta_high_s < kOneFigure * report.eta_low_s || low == high)
    return rough_duration(report.eta_s) + " left";
  return low + " to " + high + " left";
}

std::string progress_text(const StatusReport& report) {
  const auto done = static_cast<double>(report.cells_done);
  const double share = report.cells_expected > 0 ? 100 * done / report.cells_expected : 0;
  const auto expected = static_cast<std::uint64_t>(std::llround(report.cells_expected));
  // All of them only when it is over.
  const double shown = report.cells_open > 0 ? std::min(share, 99.0) : share;
  std::string text = format("%.0f %%: ", shown) + grouped(report.cells_done) + " of ";
  text += (report.cells_open > 0 ? "about " : "") + counted(expected, "cell", "cells");
  if (report.cells_per_second > 0) text += ", " + speed_text(report.cells_per_second);
  if (report.cells_open > 0) text += ", " + time_left(report);
  const auto workers =
      std::ranges::count_if(report.workers, [](const auto& w) { return w.state != "blocked"; });
  if (workers == 0 && report.cells_open > 0)
    text += ", no workers";
  else
    text += ", " + counted(static_cast<std::uint64_t>(workers), "worker", "workers");
  if (report.cells_quarantined > 0) text += ", " + grouped(report.cells_quarantined) + " given up";
  if (report.state != "running" && !report.state.empty()) text = report.state + ", " + text;
  return text + ", " + bytes_text(report.result_bytes) + " of sets";
}

void ProgressLine::show(const StatusReport& report) {
  show_text(progress_text(report), report.elapsed_ms);
}

void ProgressLine::show_text(const std::string& text, std::uint64_t elapsed_ms) {
  if (options_.quiet) return;
  if (options_.terminal) {
    if (elapsed_ms < redraw_ms_) return;
    redraw_ms_ = elapsed_ms + kRedrawEveryMs;
    // A line that wraps could not be redrawn. All of it is ASCII.
    const std::string line = text.substr(0, columns() - 1);
    if (drawn_ && line == shown_) return;
    std::cerr << "\r\033[K" << line << std::flush;
    shown_ = line;
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
  redraw_ms_ = 0;
}

}  // namespace pvsfarm

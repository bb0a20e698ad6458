// The log of a program: lines on stderr, so that stdout carries data alone.
// Only services and mains log; algorithms return statistics.
// Threads: set_up_log once, before the first line; the rest from any thread.
#pragma once

#include <string_view>

namespace pvsfarm {

enum class LogLevel { kDebug, kInfo, kWarning, kError };

struct LogSettings {
  std::string_view program;          // stands at the head of every line
  LogLevel level = LogLevel::kInfo;  // lesser lines are dropped
  bool color = false;
};

void set_up_log(const LogSettings& settings);

void log_debug(std::string_view line);
void log_info(std::string_view line);
void log_warning(std::string_view line);
void log_error(std::string_view line);

}  // namespace pvsfarm

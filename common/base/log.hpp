// The log of a program: lines on stderr, so that stdout carries data alone.
// Only services and mains log; algorithms return statistics.
// Threads: set_up_log once, before the first line; the rest from any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace pvsfarm {

enum class LogLevel { kDebug, kInfo, kWarning, kError };

struct LogSettings {
  std::string_view program;          // stands at the head of every line
  LogLevel level = LogLevel::kInfo;  // lesser lines are dropped
  bool color = false;
  bool json = false;  // an object a line: time, level, program, event, text, worker, cell, lease
};

void set_up_log(const LogSettings& settings);

// A line with what it is about, for programs that read the log; as text, `text` alone.
struct LogEvent {
  LogLevel level = LogLevel::kInfo;
  std::string event;         // one word: "lease_expired"
  std::string text;          // the line
  std::string worker, cell;  // "" if it is about none
  std::uint64_t lease = 0;   // 0 for none
};
void log_event(const LogEvent& event);

void log_debug(std::string_view line);
void log_info(std::string_view line);
void log_warning(std::string_view line);
void log_error(std::string_view line);

}  // namespace pvsfarm

// How far a bake is, for a person: one line that is redrawn on a terminal, elsewhere a line every
// ten seconds. On stderr.
#pragma once

#include <chrono>
#include <string>

#include "common/wire/messages.hpp"

namespace pvsfarm {

std::string duration_text(double seconds);   // "1 h 02 min", "3 min 07 s", "4.2 s"
std::string rough_duration(double seconds);  // "12 s", "40 min", "1.5 h"
// "20 min left", "10 min to 25 min left", "at least 10 min left", or that it is not known.
std::string time_left(const StatusReport& report);
std::string progress_text(const StatusReport& report);  // without a newline

class ProgressLine {
 public:
  struct Options {
    bool terminal = false;
    bool quiet = false;
  };
  explicit ProgressLine(const Options& options) : options_(options) {}
  ~ProgressLine() { clear(); }

  void show(const StatusReport& report);
  void show_text(const std::string& text, std::uint64_t elapsed_ms);
  void clear();  // before other lines

 private:
  static constexpr std::uint64_t kRedrawEveryMs = 400;  // often enough to look alive, and legible

  Options options_;
  bool drawn_ = false;
  std::string shown_;
  std::uint64_t redraw_ms_ = 0;
  std::uint64_t next_ms_ = 10'000;  // of the bake's own time, off a terminal
};

}  // namespace pvsfarm

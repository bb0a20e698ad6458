#include <time.h>
#include <unistd.h>

#include <cstdio>
#include <memory>

#include "coordinator/metrics/metrics.hpp"

namespace pvsfarm {
namespace {

double seconds_of(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) / 1e9;
}

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

std::uint64_t resident_bytes() {
  const std::unique_ptr<std::FILE, CloseFile> file(std::fopen("/proc/self/statm", "re"));
  unsigned long pages = 0, resident = 0;
  if (!file || std::fscanf(file.get(), "%lu %lu", &pages, &resident) != 2) return 0;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace

ProcessFigures process_figures() {
  static const double start_time_s = seconds_of(CLOCK_REALTIME);  // of the first call: the start
  return {seconds_of(CLOCK_PROCESS_CPUTIME_ID), start_time_s, resident_bytes()};
}

}  // namespace pvsfarm

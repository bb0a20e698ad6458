#include <sched.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "common/base/file.hpp"
#include "coordinator/service/farm.hpp"

namespace pvsfarm {
namespace {

// What a control group allows, in processors; none where it does not say.
double group_quota() {
  const auto text = read_file("/sys/fs/cgroup/cpu.max");  // "150000 100000", "max 100000"
  if (!text) return 0;
  std::istringstream words(*text);
  double quota_us = 0, period_us = 0;
  return words >> quota_us >> period_us && period_us > 0 ? quota_us / period_us : 0;
}

}  // namespace

unsigned usable_processors() {
  cpu_set_t set;
  CPU_ZERO(&set);
  int count = sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
  if (const double quota = group_quota(); quota > 0)
    count = std::min(count, static_cast<int>(std::ceil(quota)));
  return static_cast<unsigned>(std::max(count, 1));
}

}  // namespace pvsfarm

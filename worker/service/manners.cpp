#include "worker/service/manners.hpp"

#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

namespace pvsfarm {
namespace {

constexpr int kNicest = 19;
// linux/ioprio.h: this process; the class "idle" stands above 13 bits of level.
constexpr int kIoPriorityOfProcess = 1, kIoPriorityIdle = 3 << 13;

// False: there is such a weight, and it could not be set.
bool lower_session() {
  std::FILE* file = std::fopen("/proc/self/autogroup", "r+e");
  if (file == nullptr) return true;
  const bool leads = getsid(0) == getpid();
  const bool written = leads && std::fputs("19", file) >= 0 && std::fflush(file) == 0;
  std::fclose(file);
  return written;
}

bool sessions_are_weighed() {
  std::FILE* file = std::fopen("/proc/sys/kernel/sched_autogroup_enabled", "re");
  if (file == nullptr) return false;
  const bool enabled = std::fgetc(file) == '1';
  std::fclose(file);
  return enabled;
}

}  // namespace

void step_back(std::string& note) {
  setpriority(PRIO_PROCESS, 0, kNicest);
  syscall(SYS_ioprio_set, kIoPriorityOfProcess, 0, kIoPriorityIdle);
  if (sessions_are_weighed() && !lower_session())
    note =
        "low priority counts only among the programs of this session (autogroup); start the "
        "worker with setsid to step back behind all";
}

void run_when_idle() {
  const sched_param none{};
  sched_setscheduler(0, SCHED_IDLE, &none);
}

Status limit_memory(std::uint64_t bytes) {
  rlimit limit{};
  getrlimit(RLIMIT_DATA, &limit);
  limit.rlim_cur =
      limit.rlim_max == RLIM_INFINITY ? bytes : std::min<rlim_t>(bytes, limit.rlim_max);
  if (setrlimit(RLIMIT_DATA, &limit) == 0) return {};
  return runtime_error(std::string("cannot limit the memory: ") + std::strerror(errno));
}

}  // namespace pvsfarm

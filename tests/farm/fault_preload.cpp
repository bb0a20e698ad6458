// Loaded before a worker's own libraries (LD_PRELOAD), it makes the computing thread fail as
// machines and drivers do. PVSFARM_FAULT says how:
//
//   hang N            the N-th look at the thread's own clock (a few a cell) never returns
//   crash N           the process ends there by a signal
//   slow MS           each of them takes so long, though no processor time
//   refuse X0 X1 Y0 Y1  a ray that starts between these x and y (relative to the scene's centre)
//                     throws, as a library does that cannot go on: the same cells fail everywhere
//   burst X0 X1 Y0 Y1 such a ray ends the process by a signal
//
// Only the computing thread looks at its own clock (CLOCK_THREAD_CPUTIME_ID), so the messenger
// lives on. Threads: the hooks are called from several.
#include <dlfcn.h>
#include <signal.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <string>

namespace {

struct Fault {
  std::string kind;
  double a = 0, b = 0, c = 0, d = 0;

  Fault() {
    const char* text = std::getenv("PVSFARM_FAULT");
    std::istringstream words(text == nullptr ? "" : text);
    words >> kind >> a >> b >> c >> d;
  }
};

const Fault& fault() {
  static const Fault read;
  return read;
}

void end_by_signal() {
  kill(getpid(), SIGKILL);
  pause();
}

void sleep_ms(double ms) {
  const auto whole = static_cast<time_t>(ms / 1e3);
  const timespec time{whole, static_cast<long>((ms - 1e3 * static_cast<double>(whole)) * 1e6)};
  nanosleep(&time, nullptr);
}

void at_own_clock() {
  static std::atomic<long> count{0};
  const Fault& f = fault();
  const long now = ++count;
  if (f.kind == "slow") sleep_ms(f.a);
  if (f.kind == "crash" && now == static_cast<long>(f.a)) end_by_signal();
  if (f.kind == "hang" && now == static_cast<long>(f.a))
    for (;;) pause();
}

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* time) {
  if (clock == CLOCK_THREAD_CPUTIME_ID) {
    at_own_clock();
    return static_cast<int>(syscall(SYS_clock_gettime, clock, time));
  }
  using Real = int (*)(clockid_t, timespec*);
  static const auto real = reinterpret_cast<Real>(dlsym(RTLD_NEXT, "clock_gettime"));
  return real(clock, time);
}

// Embree's: a ray begins with its origin.
extern "C" void rtcIntersect1M(void* scene, void* context, void* rays, unsigned count,
                               std::size_t stride) {
  const Fault& f = fault();
  if (f.kind == "refuse" || f.kind == "burst") {
    for (unsigned i = 0; i < count; ++i) {
      float at[2];
      std::memcpy(at, static_cast<const char*>(rays) + i * stride, sizeof at);
      if (at[0] < f.a || at[0] > f.b || at[1] < f.c || at[1] > f.d) continue;
      if (f.kind == "burst") end_by_signal();
      throw std::runtime_error("planted: a ray from here fails");
    }
  }
  using Real = void (*)(void*, void*, void*, unsigned, std::size_t);
  static const auto real = reinterpret_cast<Real>(dlsym(RTLD_NEXT, "rtcIntersect1M"));
  real(scene, context, rays, count, stride);
}

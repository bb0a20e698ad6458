#include "coordinator/service/signals.hpp"

#include <signal.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <cstdint>

#include "common/base/check.hpp"

namespace pvsfarm {
namespace {

constexpr std::array<int, 4> kSignals{SIGINT, SIGTERM, SIGCHLD, SIGHUP};
std::array<struct sigaction, 4> before;
volatile sig_atomic_t interrupts = 0, hangups = 0;
int event = -1;

void on_signal(int number) {
  if (number == SIGHUP) {
    hangups = 1;
  } else if (number != SIGCHLD) {
    if (interrupts != 0) _exit(130);  // the journal is safe whenever we end
    interrupts = 1;
  }
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = write(event, &one, sizeof one);
}

}  // namespace

SignalWatch::SignalWatch(bool with_hangups) {
  PVS_CHECK_EQ(event, -1);
  event = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  PVS_CHECK(event >= 0);
  interrupts = 0;
  hangups = 0;
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART | SA_NOCLDSTOP;
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    const bool ours = kSignals[i] != SIGHUP || with_hangups;
    sigaction(kSignals[i], ours ? &action : nullptr, &before[i]);
  }
}

SignalWatch::~SignalWatch() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &before[i], nullptr);
  close(event);
  event = -1;
}

bool SignalWatch::interrupted() const { return interrupts != 0; }

bool SignalWatch::take_hangup() {
  if (hangups == 0) return false;
  hangups = 0;
  return true;
}

int SignalWatch::fd() const { return event; }

void SignalWatch::drain() {
  std::uint64_t count = 0;
  [[maybe_unused]] const ssize_t bytes = read(event, &count, sizeof count);
}

}  // namespace pvsfarm

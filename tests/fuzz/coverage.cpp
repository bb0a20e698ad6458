// Which branches an input takes: compiled code calls here at each (-fsanitize-coverage=trace-pc).
#include <array>
#include <cstring>

#include "tests/fuzz/driver.hpp"

namespace {

constexpr std::size_t kSlots = 1 << 16;
std::uint8_t now[kSlots];
std::uint8_t ever[kSlots];
std::uintptr_t previous = 0;

}  // namespace

// Pairs of places, relative to this function: the same in every run of a program.
extern "C" __attribute__((no_sanitize_coverage, no_sanitize("address", "undefined"))) void
__sanitizer_cov_trace_pc() {
  const auto place = reinterpret_cast<std::uintptr_t>(__builtin_return_address(0)) -
                     reinterpret_cast<std::uintptr_t>(&__sanitizer_cov_trace_pc);
  now[(place ^ previous) * 0x9e3779b97f4a7c15u >> 48] = 1;
  previous = place >> 1;
}

namespace pvsfarm::fuzz {

__attribute__((no_sanitize_coverage)) void reset_coverage() {
  std::memset(now, 0, sizeof now);
  previous = 0;
}

__attribute__((no_sanitize_coverage)) bool reached_something_new() {
  bool fresh = false;
  for (std::size_t i = 0; i < kSlots; ++i) {
    fresh = fresh || (now[i] & ~ever[i]) != 0;
    ever[i] |= now[i];
  }
  return fresh;
}

__attribute__((no_sanitize_coverage)) std::size_t reached_count() {
  std::size_t count = 0;
  for (const std::uint8_t slot : ever) count += slot;
  return count;
}

}  // namespace pvsfarm::fuzz

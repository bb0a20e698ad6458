// Which branches an input takes: compiled code calls here at each (-fsanitize-coverage=trace-pc).
#include <cstring>

#include "tests/fuzz/driver.hpp"

// What counts is not counted itself.
#define PVSFARM_UNTOUCHED __attribute__((no_sanitize_coverage, no_sanitize("address", "undefined")))

namespace {

// A byte a branch, eight of them a word: they are looked at after every input.
constexpr std::size_t kWords = 1 << 13;
std::uint64_t now[kWords];
std::uint64_t ever[kWords];
std::uintptr_t previous = 0;

}  // namespace

// Pairs of places, relative to this function: the same in every run of a program.
extern "C" PVSFARM_UNTOUCHED void __sanitizer_cov_trace_pc() {
  const auto place = reinterpret_cast<std::uintptr_t>(__builtin_return_address(0)) -
                     reinterpret_cast<std::uintptr_t>(&__sanitizer_cov_trace_pc);
  const std::size_t slot = (place ^ previous) * 0x9e3779b97f4a7c15u >> 48;
  now[slot / 8] |= 1ull << slot % 8 * 8;
  previous = place >> 1;
}

namespace pvsfarm::fuzz {

PVSFARM_UNTOUCHED void reset_coverage() {
  std::memset(now, 0, sizeof now);
  previous = 0;
}

PVSFARM_UNTOUCHED bool reached_something_new() {
  std::uint64_t fresh = 0;
  for (std::size_t i = 0; i < kWords; ++i) {
    fresh |= now[i] & ~ever[i];
    ever[i] |= now[i];
  }
  return fresh != 0;
}

PVSFARM_UNTOUCHED std::size_t reached_count() {
  int count = 0;
  for (const std::uint64_t word : ever) count += __builtin_popcountll(word);
  return static_cast<std::size_t>(count);
}

}  // namespace pvsfarm::fuzz

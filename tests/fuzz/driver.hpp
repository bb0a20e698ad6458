// A fuzzer in little: mutates inputs, keeps those that reach something new, reports those that end
// the process. It needs no other compiler, and repeats itself for the same seed.
//
//   fuzz_envelope [--seconds S] [--runs N] [--seed N] [FILE...]    FILE: run these inputs alone
//
// In the preset `fuzz` (sanitizers, and every branch tells that it was reached) the corpus grows;
// in others only the seeds are mutated. An input that crashes, hangs for 20 s or breaks a check is
// left as crash-NAME in the working folder. Exit code 1: there was one.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace pvsfarm::fuzz {

using Input = std::vector<std::uint8_t>;

// Each target defines these.
extern const char* const kTarget;  // "envelope"
extern const std::size_t kMaxInput;
std::vector<Input> seeds();
void run(std::span<const std::uint8_t> input);

inline Input input_of(const std::string& text) { return {text.begin(), text.end()}; }

// What was reached since the last reset, in coverage.cpp.
void reset_coverage();
bool reached_something_new();  // and remembers it
std::size_t reached_count();

}  // namespace pvsfarm::fuzz

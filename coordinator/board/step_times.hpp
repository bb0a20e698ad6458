// How long cells take: quantiles over all that were completed, in constant memory and to one part
// in eight, the next larger being told. Threads: one.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>

namespace pvsfarm {

class StepTimes {
 public:
  void add(double ms);
  // What the fraction `q` of all stays below. Zero: nothing is known yet.
  std::chrono::milliseconds quantile(double q) const;
  std::uint64_t count() const { return count_; }

 private:
  static constexpr std::size_t kParts = 8;     // of an octave
  static constexpr std::size_t kOctaves = 32;  // from 1/8 ms up: 17 hours
  std::array<std::uint64_t, kParts * kOctaves> counts_{};
  std::uint64_t count_ = 0;
};

}  // namespace pvsfarm

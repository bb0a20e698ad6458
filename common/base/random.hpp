// A small seeded generator (SplitMix64, Steele et al. 2014) whose numbers are the same on every
// machine and library, unlike the distributions of <random>.
#pragma once

#include <cstdint>

namespace pvsfarm {

class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ull);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
  }
  double unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }  // [0, 1)
  double between(double lo, double hi) { return lo + (hi - lo) * unit(); }
  std::uint64_t below(std::uint64_t n) { return next() % n; }  // n > 0; the bias is negligible

 private:
  std::uint64_t state_;
};

}  // namespace pvsfarm

#include "coordinator/board/step_times.hpp"

#include <algorithm>
#include <cmath>

namespace pvsfarm {
namespace {
constexpr double kShortest_ms = 0.125;
}

void StepTimes::add(double ms) {
  int exponent = 0;
  const double mantissa = std::frexp(std::max(ms, kShortest_ms) / kShortest_ms, &exponent);
  const auto part = static_cast<std::size_t>((mantissa - 0.5) * 2 * kParts);
  const std::size_t octave =
      std::min<std::size_t>(static_cast<std::size_t>(exponent - 1), kOctaves - 1);
  ++counts_[octave * kParts + std::min(part, kParts - 1)];
  ++count_;
}

std::chrono::milliseconds StepTimes::quantile(double q) const {
  if (count_ == 0) return {};
  const auto wanted = static_cast<std::uint64_t>(std::ceil(q * static_cast<double>(count_)));
  std::uint64_t below = 0;
  std::size_t i = 0;
  while (i + 1 < counts_.size() && (below += counts_[i]) < wanted) ++i;
  const double part = static_cast<double>(i % kParts + 1) / kParts;  // the bucket's upper edge
  const double ms = std::ldexp(kShortest_ms * (1 + part), static_cast<int>(i / kParts));
  return std::chrono::milliseconds(static_cast<std::int64_t>(std::ceil(ms)));
}

}  // namespace pvsfarm

#include "common/pvs/hints.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace pvsfarm {
namespace {

constexpr int kStepsAnOctave = 8;
constexpr int kSmallestOctave = -28;  // about 6e-5 radians across: far below a pixel
constexpr std::array<double, kStepsAnOctave> kSteps{1,
                                                    1.0905077326652577,
                                                    1.1892071150027210,
                                                    1.2968395546510096,
                                                    1.4142135623730951,
                                                    1.5422108254079407,
                                                    1.6817928305074290,
                                                    1.8340080864093424};

// The hints of one half, asked for in ascending order of objects.
class HalfReader {
 public:
  explicit HalfReader(const HalfHints& half) : half_(half) {}
  VisibilityHint next(ObjectId id) {
    if (!half_.set.contains(id)) return {};
    const std::size_t at = position_++;
    return half_.row.empty() ? kUnknownHint : hint_at(half_.row, at);
  }

 private:
  const HalfHints& half_;
  std::size_t position_ = 0;
};

}  // namespace

std::uint8_t degree_of(std::uint32_t seen, std::uint32_t viewpoints) {
  PVS_CHECK_LE(seen, viewpoints);
  if (seen == 0) return 0;
  const std::uint64_t scaled = std::uint64_t{255} * seen + viewpoints - 1;
  return static_cast<std::uint8_t>(scaled / viewpoints);
}

std::uint8_t size_of(double steradians) {
  if (!(steradians > 0)) return 0;
  int octave = 0;
  const double mantissa = 2 * std::frexp(steradians, &octave);
  --octave;
  const auto above = std::upper_bound(kSteps.begin(), kSteps.end(), mantissa);
  const int step = static_cast<int>(above - kSteps.begin()) - 1;
  return static_cast<std::uint8_t>(
      std::clamp(kStepsAnOctave * (octave - kSmallestOctave) + step, 1, 255));
}

double steradians_of(std::uint8_t size) {
  if (size == 0) return 0;
  return std::ldexp(kSteps[size % kStepsAnOctave], size / kStepsAnOctave + kSmallestOctave);
}

VisibilityHint hint_at(std::span<const std::byte> row, std::size_t position) {
  const std::size_t count = row.size() / 2;
  PVS_CHECK_LT(position, count);
  return {std::to_integer<std::uint8_t>(row[position]),
          std::to_integer<std::uint8_t>(row[count + position])};
}

HintBytes pack_hints(std::span<const VisibilityHint> hints) {
  HintBytes row(2 * hints.size());
  for (std::size_t i = 0; i < hints.size(); ++i) {
    row[i] = static_cast<std::byte>(hints[i].degree);
    row[hints.size() + i] = static_cast<std::byte>(hints[i].size);
  }
  return row;
}

HintBytes unknown_hints(std::size_t objects) {
  return pack_hints(std::vector<VisibilityHint>(objects, kUnknownHint));
}

HintBytes united_hints(const VisibleSet& whole, const HalfHints& low, const HalfHints& high) {
  HalfReader lows(low), highs(high);
  std::vector<VisibilityHint> united;
  whole.for_each([&](ObjectId id) {
    const VisibilityHint a = lows.next(id), b = highs.next(id);
    const int degrees = a.degree + b.degree;
    united.push_back({static_cast<std::uint8_t>((degrees + 1) / 2), std::max(a.size, b.size)});
  });
  return pack_hints(united);
}

}  // namespace pvsfarm

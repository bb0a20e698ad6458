#include "coordinator/picture/color_scale.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace pvsfarm {
namespace {
constexpr std::array<Color, 8> kAnchors{rgb(0xe0f3db), rgb(0xccebc5), rgb(0xa8ddb5), rgb(0x7bccc4),
                                        rgb(0x4eb3d3), rgb(0x2b8cbe), rgb(0x0868ac), rgb(0x084081)};
}

Color scale_color(double t) {
  const double at = std::clamp(t, 0.0, 1.0) * (kAnchors.size() - 1);
  const auto index = std::min(static_cast<std::size_t>(at), kAnchors.size() - 2);
  const double part = at - static_cast<double>(index);
  const auto mix = [&](std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(std::lround(a + (b - a) * part));
  };
  const Color &a = kAnchors[index], &b = kAnchors[index + 1];
  return {mix(a.red, b.red), mix(a.green, b.green), mix(a.blue, b.blue)};
}

double round_below(double limit) {
  const double power = std::pow(10, std::floor(std::log10(limit)));
  for (const double digit : {5.0, 2.0})
    if (digit * power <= limit) return digit * power;
  return power;
}

std::vector<double> round_marks(double lo, double hi, int most) {
  if (!(lo < hi)) return {lo};
  // The smallest round step that leaves at most `most` marks.
  double step = round_below((hi - lo) / most);
  while (std::floor(hi / step) - std::ceil(lo / step) + 1 > most) step = round_below(step * 2.5);
  std::vector<double> marks;
  for (double i = std::ceil(lo / step); i * step <= hi; ++i) marks.push_back(i * step);
  return marks;
}

std::string plain_number(double value) {
  std::array<char, 64> digits;
  const bool whole = value == std::floor(value);
  std::snprintf(digits.data(), digits.size(), whole ? "%.0f" : "%.3g", value);
  const std::string text = digits.data();
  if (!whole) return text;
  std::string grouped;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (i > 0 && text[i - 1] != '-' && (text.size() - i) % 3 == 0) grouped += ',';
    grouped += text[i];
  }
  return grouped;
}

}  // namespace pvsfarm

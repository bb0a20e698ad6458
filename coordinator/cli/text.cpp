#include "coordinator/cli/text.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace pvsfarm {

std::string grouped(std::uint64_t value) {
  std::string text = std::to_string(value);
  for (std::size_t at = text.size(); at > 3;) text.insert(at -= 3, 1, ',');
  return text;
}

std::string fixed(double value, int decimals) {
  std::array<char, 400> buffer;
  std::snprintf(buffer.data(), buffer.size(), "%.*f", decimals, value);
  return buffer.data();
}

std::string round_trip(double value) {
  std::array<char, 32> buffer;
  const auto [end, error] =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value + 0.0);  // no -0
  return {buffer.data(), end};
}

std::string bytes_text(std::uint64_t bytes) {
  if (bytes < 10'000) return grouped(bytes) + " bytes";
  const auto value = static_cast<double>(bytes);
  if (bytes < 1'000'000) return fixed(value / 1e3, 1) + " kB";
  return bytes < 1'000'000'000 ? fixed(value / 1e6, 1) + " MB" : fixed(value / 1e9, 1) + " GB";
}

std::string counted(std::uint64_t n, std::string_view one, std::string_view many) {
  return grouped(n) + " " + std::string(n == 1 ? one : many);
}

std::string point_text(const Vec3& p) {
  std::array<char, 100> buffer;
  std::snprintf(buffer.data(), buffer.size(), "%.6g,%.6g,%.6g", p.x + 0.0, p.y + 0.0, p.z + 0.0);
  return buffer.data();
}

std::string ascii(std::string text) {
  for (char& c : text)
    if (c < ' ' || c > '~') c = '?';
  return text;
}

std::string path_text(const CellKey& key) {
  std::string text;
  for (int bit = key.depth() - 1; bit >= 0; --bit) text += (key.path >> bit & 1) != 0 ? '1' : '0';
  return text;
}

void append_json(std::string& out, double value) {
  out += std::isfinite(value) ? round_trip(value) : "null";
}

void append_json(std::string& out, const Vec3& v) {
  for (int a = 0; a < 3; ++a) {
    out += a == 0 ? '[' : ',';
    append_json(out, v[a]);
  }
  out += ']';
}

void append_json(std::string& out, std::string_view text) {
  out += nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace pvsfarm

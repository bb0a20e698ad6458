// Words and numbers of the commands' answers.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/ids.hpp"
#include "common/geometry/vec.hpp"

namespace pvsfarm {

std::string grouped(std::uint64_t value);       // 12,345,678
std::string fixed(double value, int decimals);  // 12.3
std::string round_trip(double value);           // the shortest that reads back the same
std::string bytes_text(std::uint64_t bytes);    // 12.3 MB
std::string counted(std::uint64_t n, std::string_view one, std::string_view many);  // 1 cell
std::string point_text(const Vec3& p);  // 1.5,2,-3: six digits, for people
std::string ascii(std::string text);    // what pictures can write, else '?'
// The splits from the root, 0 the low half and 1 the high: "" is a root.
std::string path_text(const CellKey& key);

// JSON text, for answers too long to hold: appended piece by piece.
void append_json(std::string& out, double value);  // null where JSON has no number
void append_json(std::string& out, const Vec3& v);
void append_json(std::string& out, std::string_view text);  // quoted; broken UTF-8 replaced

}  // namespace pvsfarm

// Data files of one JSON object a line.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "common/base/result.hpp"

namespace pvsfarm {

// Calls f(object) for every line that is not blank; f may throw what the JSON package throws.
// Errors: kInvalidInput, naming `where`, the line, and `what` such a line is.
template <class F>
Status for_each_json_line(std::string_view lines, const std::string& where, const char* what,
                          F&& f) {
  for (std::size_t number = 1; !lines.empty(); ++number) {
    const std::size_t end = std::min(lines.find('\n'), lines.size());
    const std::string_view line = lines.substr(0, end);
    lines.remove_prefix(std::min(end + 1, lines.size()));
    if (line.find_first_not_of(" \t\r") == std::string_view::npos) continue;
    try {
      f(nlohmann::json::parse(line));
    } catch (const nlohmann::json::exception& error) {
      return invalid_input(where + ":" + std::to_string(number) + ": not " + what + ": " +
                           error.what());
    }
  }
  return {};
}

}  // namespace pvsfarm

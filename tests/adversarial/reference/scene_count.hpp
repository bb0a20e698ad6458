// How many random scenes a property test of a reference runs: its own number, or PVSFARM_SCENES if
// that is more.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>

namespace pvsfarm::reference {

inline std::uint64_t scene_count(std::uint64_t at_least) {
  const char* text = std::getenv("PVSFARM_SCENES");
  return text == nullptr ? at_least
                         : std::max<std::uint64_t>(at_least, std::strtoull(text, nullptr, 10));
}

}  // namespace pvsfarm::reference

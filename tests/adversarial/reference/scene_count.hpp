// How many random scenes a property test of a reference runs: PVSFARM_SCENES, or its own number.
#pragma once

#include <cstdint>
#include <cstdlib>

namespace pvsfarm::reference {

inline std::uint64_t scene_count(std::uint64_t otherwise) {
  const char* text = std::getenv("PVSFARM_SCENES");
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

}  // namespace pvsfarm::reference

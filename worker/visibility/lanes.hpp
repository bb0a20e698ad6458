// Eight numbers side by side, for loops that compile badly otherwise. The compiler makes of them
// what the instruction set has; inside PVSFARM_DISPATCH functions, one version for each.
//
// For .cpp files alone. Everything is done lane by lane, and what goes across lanes is a maximum or
// a sum of small integers: the same bits everywhere.
#pragma once

#include <cstdint>

#define PVSFARM_INLINE inline __attribute__((always_inline))

// For the whole file that includes this: how lanes are passed to functions depends on the
// instruction set, but here nothing is passed, all of it is inlined.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace pvsfarm {

using Eight = double __attribute__((vector_size(64)));
using EightFloats = float __attribute__((vector_size(32)));
using EightWords = std::uint64_t __attribute__((vector_size(64)));
using EightPlaces = std::int64_t __attribute__((vector_size(64)));
using EightInts = std::int32_t __attribute__((vector_size(32)));

PVSFARM_INLINE Eight all_lanes(double v) { return Eight{v, v, v, v, v, v, v, v}; }
PVSFARM_INLINE Eight larger(const Eight& a, const Eight& b) { return a > b ? a : b; }
PVSFARM_INLINE Eight smaller(const Eight& a, const Eight& b) { return a < b ? a : b; }
PVSFARM_INLINE Eight magnitude(const Eight& a) { return a < 0 ? -a : a; }

PVSFARM_INLINE double largest(const Eight& v) {
  const Eight a = larger(v, __builtin_shuffle(v, EightPlaces{4, 5, 6, 7, 0, 1, 2, 3}));
  const Eight b = larger(a, __builtin_shuffle(a, EightPlaces{2, 3, 0, 1, 6, 7, 4, 5}));
  return b[0] > b[1] ? b[0] : b[1];
}
PVSFARM_INLINE double smallest(const Eight& v) { return -largest(-v); }

// Flags are lanes of 1 and 0. Join conditions as minima of differences or as bits_of(): of
// comparisons joined with & or *, some compilers make eight scalar ones.
PVSFARM_INLINE Eight above(const Eight& a, const Eight& b) {
  return a > b ? all_lanes(1) : all_lanes(0);
}
PVSFARM_INLINE Eight not_above(const Eight& a, const Eight& b) {
  return a <= b ? all_lanes(1) : all_lanes(0);
}
PVSFARM_INLINE Eight equal(const Eight& a, const Eight& b) {
  return a == b ? all_lanes(1) : all_lanes(0);
}
PVSFARM_INLINE Eight choose(const Eight& flags, const Eight& a, const Eight& b) {
  return flags > 0 ? a : b;
}

// Bit k: flag k.
PVSFARM_INLINE unsigned bits_of(const Eight& flags) {
  const Eight bits = flags * Eight{1, 2, 4, 8, 16, 32, 64, 128};
  const Eight a = bits + __builtin_shuffle(bits, EightPlaces{4, 5, 6, 7, 0, 1, 2, 3});
  const Eight b = a + __builtin_shuffle(a, EightPlaces{2, 3, 0, 1, 6, 7, 4, 5});
  return static_cast<unsigned>(b[0] + b[1]);
}

PVSFARM_INLINE bool any_bits(const EightWords& words) {
  const EightWords a = words | __builtin_shuffle(words, EightPlaces{4, 5, 6, 7, 0, 1, 2, 3});
  const EightWords b = a | __builtin_shuffle(a, EightPlaces{2, 3, 0, 1, 6, 7, 4, 5});
  return (b[0] | b[1]) != 0;
}

template <class Lanes>
PVSFARM_INLINE Lanes load_lanes(const void* from) {
  Lanes lanes;
  __builtin_memcpy(&lanes, from, sizeof lanes);
  return lanes;
}
template <class Lanes>
PVSFARM_INLINE void store_lanes(void* to, const Lanes& lanes) {
  __builtin_memcpy(to, &lanes, sizeof lanes);
}

}  // namespace pvsfarm

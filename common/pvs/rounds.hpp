// The turns of a cell's cascade: which method was tried, with what, on how much, and what came of
// it. A cascade chooses by what is still open; this tells what it chose, and whether it paid.
//
// Bytes (on the wire, in the journal): the number of rounds, then each one's fields in the order of
// the struct; whole numbers as LEB128, floats as their bits, the maps' fields but the first two
// only where there are planes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/pvs/method.hpp"

namespace pvsfarm {

// The maps that a round drew, or looked at again.
struct MapsUsed {
  std::uint32_t planes = 0;
  std::uint32_t resolution_px = 0;      // a side of the finest; of views, too, which have no planes
  std::uint32_t occluders = 0;          // that were on hand for them; 0 where all of the scene is
  float nearest_m = 0, farthest_m = 0;  // planes before their faces of the cell
  float extent = 0;  // the widest, from its middle, over (half the cell's side + distance)
  friend bool operator==(const MapsUsed&, const MapsUsed&) = default;
};

struct CascadeRound {
  Method method = Method::kLookAround;
  MapsUsed maps;
  std::uint32_t open_objects = 0;  // when it began
  std::uint64_t open_triangles = 0;
  std::uint32_t hidden_objects = 0, seen_objects = 0;  // of them, by it
  std::uint64_t hidden_triangles = 0, seen_triangles = 0;
  std::uint64_t work = 0;  // as of MethodStatistics
  float cpu_ms = 0;
  friend bool operator==(const CascadeRound&, const CascadeRound&) = default;
};

// [limit] Of a cell. Beyond it, a method's later rounds are added to its last one.
inline constexpr std::size_t kMaxRounds = 32;
inline constexpr std::size_t kMaxRoundBytes = 96;  // each, at most

void append_round(std::vector<CascadeRound>& rounds, const CascadeRound& round);

std::vector<std::byte> encode_rounds(std::span<const CascadeRound> rounds);
// False: no such bytes (cut short, too long, too many, a number out of its range).
bool decode_rounds(std::span<const std::byte> bytes, std::vector<CascadeRound>& out);

}  // namespace pvsfarm

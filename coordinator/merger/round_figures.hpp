// The rounds of many cascades, summed: what each method's first turn was given and settled, its
// second, and so on.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/pvs/rounds.hpp"

namespace pvsfarm {

// One method's same turn, in all evaluations that came to it.
struct RoundFigures {
  Method method = Method::kLookAround;
  std::uint32_t turn = 0;   // of the method in its cascade, from 0
  std::uint64_t cells = 0;  // evaluations that had it
  std::uint64_t planes = 0, occluders = 0;
  std::uint32_t resolution_px = 0;       // the finest
  double nearest_m = 0, farthest_m = 0;  // over all of them; as is the widest extent
  double extent = 0;
  std::uint64_t open_objects = 0, open_triangles = 0;
  std::uint64_t hidden_objects = 0, seen_objects = 0, hidden_triangles = 0, seen_triangles = 0;
  std::uint64_t work = 0;
  double cpu_ms = 0;
};

// In the order in which turns came up first.
class RoundSums {
 public:
  void add(std::span<const CascadeRound> rounds);  // of one evaluation
  void add(const RoundSums& other);
  std::span<const RoundFigures> all() const { return sums_; }

 private:
  void add(const RoundFigures& figures);
  std::vector<RoundFigures> sums_;
};

// One JSON object: {"method":"projection","cells":3,"open":[objects,triangles],"hidden":[..],
// "seen":[..],"work":..,"ms":..} and, of maps, "planes", "px", "occluders", "from_m", "to_m",
// "extent". `cells` only if more than one; what would be 0 is left out.
std::string json_of(const RoundFigures& round);

}  // namespace pvsfarm

// The methods of the cascade: what can settle an object of a cell, from one side or the other.
// Every method only adds witnesses (seen) or certificates (hidden) and can be left out (ADR 7).
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string_view>

namespace pvsfarm {

enum class Method : std::uint8_t {
  kLookAround = 0,      // witnesses: rays in all directions
  kAimedRays = 1,       // witnesses: rays at what is open
  kItemBuffers = 2,     // witnesses: rendered views of what is open
  kProjection = 3,      // prover: extended Projections
  kFineProjection = 4,  // prover: the same on more planes and smaller parts, for what is open
  kSurfaces = 5,        // prover: whole surfaces, fused over their inner edges, as occluders
  kImproved = 6,        // prover: the improved Projection of occludees before a plane
  kSlices = 7,          // prover: sections of closed solids with the planes of the others
  kSweep = 8,           // prover: occlusion sweep, maps re-projected from plane to plane
  kShafts = 9,          // prover: surfaces between parts of the cell and parts of an object
};
inline constexpr int kMethodCount = 10;

// Names of command lines, statistics and charts: "look-around", "aimed-rays", "item-buffers",
// "projection", "fine-projection", "surfaces", "improved", "slices", "sweep", "shafts".
const char* to_string(Method method);
std::optional<Method> method_named(std::string_view name);

// A set of methods.
class Methods {
 public:
  constexpr Methods() = default;
  constexpr Methods(std::initializer_list<Method> list) {
    for (const Method method : list) bits_ |= bit(method);
  }
  static constexpr Methods from_bits(std::uint32_t bits) {
    Methods methods;
    methods.bits_ = bits & ((1u << kMethodCount) - 1);
    return methods;
  }
  constexpr bool has(Method method) const { return (bits_ & bit(method)) != 0; }
  constexpr std::uint32_t bits() const { return bits_; }
  friend constexpr bool operator==(const Methods&, const Methods&) = default;

 private:
  static constexpr std::uint32_t bit(Method method) { return 1u << static_cast<unsigned>(method); }
  std::uint32_t bits_ = 0;
};

// What one method did for one cell. Never part of the result's identity.
struct MethodStatistics {
  std::uint32_t hidden_objects = 0, seen_objects = 0;  // that no method before it had settled
  std::uint64_t hidden_triangles = 0, seen_triangles = 0;
  std::uint64_t work = 0;  // rays cast, or pieces projected
  double cpu_ms = 0;       // 0 where nobody tells the time
  friend bool operator==(const MethodStatistics&, const MethodStatistics&) = default;
};
using StatisticsByMethod = std::array<MethodStatistics, kMethodCount>;

}  // namespace pvsfarm

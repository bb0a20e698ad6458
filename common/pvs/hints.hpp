// Hints for the level of detail: from what part of a cell an object of its PVS shows, and how large
// at most. Estimates from samples: what to draw coarsely or fetch late, never a reason to cull. An
// object that no sample met may be in full view of a viewpoint between two samples.
//
// Source: the degree of Lim's fuzzy visibility (Durand 2000, extended, 7.4; theory F).
// Shape: a row of hints belongs to a set of n objects, in ascending order: n degrees, n sizes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/pvs/visible_set.hpp"

namespace pvsfarm {

struct VisibilityHint {
  // 255 * seen / viewpoints, rounded up: 0 only if no sample and no witness saw it.
  std::uint8_t degree = 0;
  // Of the largest solid angle at which a viewpoint saw it: 0 with degree 0, else
  // 1 + an eighth of an octave a step (size_of).
  std::uint8_t size = 0;
  friend bool operator==(const VisibilityHint&, const VisibilityHint&) = default;
};
// Of what nobody sampled: all of it may be in view.
inline constexpr VisibilityHint kUnknownHint{255, 255};

using HintBytes = std::vector<std::byte>;

std::uint8_t degree_of(std::uint32_t seen, std::uint32_t viewpoints);
// Rounded down to an eighth of an octave. [units] steradians, 0 .. 4 pi
std::uint8_t size_of(double steradians);
double steradians_of(std::uint8_t size);

// The hints of a row, in the order of its objects. Requires: an even number of bytes.
VisibilityHint hint_at(std::span<const std::byte> row, std::size_t position);
HintBytes pack_hints(std::span<const VisibilityHint> hints);
HintBytes unknown_hints(std::size_t objects);

// Those of a cell, from its two halves: degrees are averaged, for the halves have equal volumes;
// of sizes the larger one counts. `whole` is the union of the sets. An empty row: unknown.
struct HalfHints {
  const VisibleSet& set;
  std::span<const std::byte> row;
};
HintBytes united_hints(const VisibleSet& whole, const HalfHints& low, const HalfHints& high);

}  // namespace pvsfarm

// In which order the cells of a bake are handed out.
#pragma once

#include <cstdint>
#include <tuple>

#include "coordinator/tree/tree.hpp"

namespace pvsfarm {

// Roots that lie next to each other are alike, so whoever goes from one end of the scene to the
// other knows half of it when half is done, and what is left may cost twice as much or nothing. In
// this order every first part of the roots is spread evenly over all of them, and so tells of the
// rest: 0, 1/2, 1/4, 3/4, 1/8 ... of the way (van der Corput 1935). A root and all that comes of it
// stay together.
struct TaskOrder {
  // So many neighbours are handed out one after the other, for the sake of a journal of very many
  // roots: rows next to each other are written together. 0: all, in canonical order.
  std::uint32_t run_roots = 0;

  static constexpr std::uint32_t kRuns = 4096;
  static TaskOrder spread(std::size_t roots) {
    return {static_cast<std::uint32_t>(roots / kRuns + 1)};
  }

  bool operator()(const CellKey& a, const CellKey& b) const {
    if (run_roots == 0) return a < b;
    const std::uint32_t run_a = a.root / run_roots, run_b = b.root / run_roots;
    if (run_a != run_b) return turned_round(run_a) < turned_round(run_b);
    return a < b;
  }

 private:
  // The bits of the number in the other order.
  static std::uint32_t turned_round(std::uint32_t number) {
    std::uint32_t turned = 0;
    for (int bit = 0; bit < 32; ++bit, number >>= 1) turned = turned << 1 | (number & 1);
    return turned;
  }
};

}  // namespace pvsfarm

// What tests of the task board share: three workers, and boards of whole cells.
#pragma once

#include "coordinator/board/board.hpp"

namespace pvsfarm {

using namespace std::chrono_literals;

inline constexpr WorkerId kAnn{1}, kBob{2}, kCid{3};

inline CellKey root(std::uint32_t i) { return {i, 1}; }

inline Board board_of(std::uint32_t cells, const BoardLimits& limits = {}) {
  Board board(limits);
  for (std::uint32_t i = cells; i-- > 0;) board.add(root(i));
  return board;
}

}  // namespace pvsfarm

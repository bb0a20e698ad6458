#include "common/cells/cell.hpp"

#include <cmath>

#include "common/base/check.hpp"

namespace pvsfarm {

Box Cell::bounds() const {
  Box box;
  for (int k = 0; k < 8; ++k) box.add(corner(k));
  if (origin == Vec3(0) && axes == Cell{}.axes) return box;
  // corner() rounds: at most a few units in the last place of its largest term.
  double largest = 0;
  for (int a = 0; a < 3; ++a)
    largest = std::max({largest, std::abs(origin[a]), std::abs(lo[a]), std::abs(hi[a])});
  box.lo -= Vec3(largest * 0x1p-48);
  box.hi += Vec3(largest * 0x1p-48);
  return box;
}

int Cell::longest_axis() const {
  int longest = 0;
  for (int a = 1; a < 3; ++a)
    if (hi[a] - lo[a] > hi[longest] - lo[longest]) longest = a;
  return longest;
}

static double middle(const Cell& cell, int axis) {
  return cell.lo[axis] * 0.5 + cell.hi[axis] * 0.5;
}

bool can_split(const Cell& cell, int axis) {
  const double mid = middle(cell, axis);
  return cell.lo[axis] < mid && mid < cell.hi[axis];
}

std::pair<Cell, Cell> split(const Cell& cell, int axis) {
  PVS_CHECK(can_split(cell, axis));
  Cell low = cell, high = cell;
  low.hi[axis] = high.lo[axis] = middle(cell, axis);
  return {low, high};
}

void add_to_digest(DigestBuilder& digest, const Cell& cell) {
  for (int a = 0; a < 3; ++a) {
    digest.add_f64(cell.origin[a]).add_f64(cell.lo[a]).add_f64(cell.hi[a]);
    for (int b = 0; b < 3; ++b) digest.add_f64(cell.axes[a][b]);
  }
}

}  // namespace pvsfarm

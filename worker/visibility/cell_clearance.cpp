#include "worker/visibility/cell_clearance.hpp"

#include <algorithm>
#include <cmath>

namespace pvsfarm {
namespace {

constexpr double kRounding = 0x1p-44;  // relative; dominates three dozen operations

double size_of(const Vec3& p) { return std::abs(p.x) + std::abs(p.y) + std::abs(p.z); }

}  // namespace

bool has_world_coordinates(const Cell& cell) {
  return cell.axes == Cell{}.axes && cell.origin == Vec3(0);
}

std::uint8_t beyond_faces(const Vec3& world, const Vec3& local, const Cell& cell,
                          const CellFrame& frame) {
  unsigned bits = 0;
  const double margin = kRounding * (size_of(local) + frame.offset_scale());
  const bool exact = has_world_coordinates(cell);
  for (int a = 0; a < 3; ++a) {
    // A cell without depth lies in its face: what touches that may pass through all eyes.
    const bool touch = cell.lo[a] < cell.hi[a];
    const bool below = exact ? world[a] < cell.lo[a] || (touch && world[a] == cell.lo[a])
                             : local[a] + frame.half()[a] < -margin;
    const bool above = exact ? world[a] > cell.hi[a] || (touch && world[a] == cell.hi[a])
                             : local[a] - frame.half()[a] > margin;
    bits |= (below ? 1u : 0u) << (2 * a) | (above ? 1u : 0u) << (2 * a + 1);
  }
  return static_cast<std::uint8_t>(bits);
}

int side_of_cell(const CornersAtCell& triangle, const Cell& cell, const CellFrame& frame) {
  const auto& [world, local] = triangle;
  const Vec3 ab = local[1] - local[0], ac = local[2] - local[0], n = cross(ab, ac);
  const Vec3& half = frame.half();
  const double around = size_of(local[0]) + frame.offset_scale() + size_of(half);
  const double normal_error =
      kRounding * (around + size_of(ab) + size_of(ac)) * (size_of(ab) + size_of(ac));
  const double ahead = -dot(n, local[0]);  // of the cell's centre
  const double reach = std::abs(n.x) * half.x + std::abs(n.y) * half.y + std::abs(n.z) * half.z;
  const double error = normal_error * around;
  if (ahead - reach > error) return 1;
  if (-ahead - reach > error) return -1;
  if (!has_world_coordinates(cell)) return 0;
  for (int a = 0; a < 3; ++a) {
    const double at = world[0][a];
    if (at != world[1][a] || at != world[2][a] || !(cell.lo[a] < cell.hi[a])) continue;
    if (!(std::abs(n[a]) > normal_error)) return 0;
    if (at <= cell.lo[a]) return n[a] > 0 ? 1 : -1;
    if (at >= cell.hi[a]) return n[a] > 0 ? -1 : 1;
  }
  return 0;
}

bool near_cell(const CornersAtCell& triangle, const CellFrame& frame, double near_m) {
  if (!(near_m > 0)) return false;
  Box box;
  for (const Vec3& p : triangle.local) box.add(p);
  const double margin = kRounding * (size_of(box.lo) + size_of(box.hi) + frame.offset_scale());
  for (int a = 0; a < 3; ++a)
    if (box.lo[a] - frame.half()[a] > near_m + margin ||
        -frame.half()[a] - box.hi[a] > near_m + margin)
      return false;
  return true;
}

}  // namespace pvsfarm

#include "coordinator/audit/neighbours.hpp"

#include <algorithm>

namespace pvsfarm {
namespace {
constexpr double kBeyond[]{0.001, 0.5};  // of the cell's size across the face
constexpr double kThin_m = 0.01;         // a cell without extent there has neighbours all the same
}  // namespace

Result<std::vector<std::uint32_t>> neighbours_of(StoreReader& store, const StoredNode& node) {
  std::vector<std::uint32_t> found;
  const Cell& cell = node.cell;
  const Vec3 size = cell.hi - cell.lo;
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2;
    for (const double beyond : kBeyond) {
      Vec3 t = cell.lo + size * 0.5;
      const double off = std::max(size[axis] * beyond, kThin_m);
      t[axis] = face % 2 == 0 ? cell.lo[axis] - off : cell.hi[axis] + off;
      const auto leaves = store.leaves_at(cell.point(t));
      if (!leaves) return leaves.error();
      found.insert(found.end(), leaves->begin(), leaves->end());
    }
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  std::erase(found, node.index);
  return found;
}

}  // namespace pvsfarm

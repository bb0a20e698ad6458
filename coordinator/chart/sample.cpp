#include "coordinator/chart/sample.hpp"

#include <algorithm>
#include <utility>

#include "common/base/random.hpp"
#include "common/geometry/box.hpp"

namespace pvsfarm {

std::vector<std::uint32_t> spread_sample(std::span<const RootCell> cells, std::size_t count,
                                         std::uint64_t seed) {
  Box bounds;
  for (const RootCell& cell : cells) bounds.add(cell.cell.center());
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
  for (std::uint32_t i = 0; i < cells.size(); ++i)
    order.emplace_back(morton_code(cells[i].cell.center(), bounds), i);
  std::sort(order.begin(), order.end());

  count = std::min(count, cells.size());
  Random random(seed);
  std::vector<std::uint32_t> sample;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t first = k * cells.size() / count, last = (k + 1) * cells.size() / count;
    sample.push_back(order[first + random.below(last - first)].second);
  }
  return sample;
}

}  // namespace pvsfarm

#include "worker/evaluator/evidence.hpp"

namespace pvsfarm {

std::uint32_t group_of_watched(const Evidence* watched, const VisibleSet& open,
                               const BvhNode& node) {
  if (watched == nullptr || !open.contains(watched->object) ||
      index_of(watched->object) - node.first >= node.count)
    return 0;
  std::uint32_t count = 0;
  for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
    count += open.contains(ObjectId{i}) ? 1 : 0;
  return count;
}

}  // namespace pvsfarm

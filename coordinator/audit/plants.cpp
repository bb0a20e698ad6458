#include "coordinator/audit/plants.hpp"

#include <algorithm>
#include <utility>

#include "common/base/random.hpp"

namespace pvsfarm {
namespace {

constexpr std::size_t kLooks = 4;  // that all must see the object
constexpr std::uint64_t kRaysALook = 250;
constexpr std::size_t kSpareCells = 8;  // asked about beyond those that are needed

std::vector<std::uint32_t> some_leaves(StoreReader& store, std::size_t count, Random& random) {
  std::vector<std::uint32_t> leaves;
  for (std::uint32_t i = 0; i < store.node_count(); ++i) {
    const auto node = store.node(i);
    if (node && node->leaf) leaves.push_back(i);
  }
  const std::size_t wanted = std::min(count, leaves.size());
  for (std::size_t i = 0; i < wanted; ++i)
    std::swap(leaves[i], leaves[i + random.below(leaves.size() - i)]);
  leaves.resize(wanted);
  return leaves;
}

}  // namespace

Result<std::vector<Plant>> choose_plants(StoreReader& store, std::size_t count, std::uint64_t seed,
                                         const AskAudits& ask) {
  Random random(seed ^ 0x706c616e74ull);
  const std::vector<std::uint32_t> cells = some_leaves(store, 2 * count + kSpareCells, random);
  std::vector<Question> questions;
  const VisibleSet all = VisibleSet::all(store.object_count());
  const VisibleSet none = VisibleSet::none(store.object_count());
  for (const std::uint32_t cell : cells) {
    const auto node = store.node(cell);
    if (!node) return node.error();
    // Nothing is outside this "PVS", so every ray looks around.
    for (std::size_t look = 0; look < kLooks; ++look)
      questions.emplace_back(
          AuditQuestion{node->key, node->cell, all, none, random.next(), kRaysALook});
  }
  const auto findings = ask(questions);
  if (!findings) return findings.error();

  std::vector<Plant> plants;
  for (std::size_t i = 0; i < cells.size() && plants.size() < count; ++i) {
    const auto sets = store.sets(cells[i]);
    if (!sets) return sets.error();
    VisibleSet plain = sets->visible;
    for (std::size_t look = 0; look < kLooks; ++look) {
      const VisibleSet& seen = (*findings)[i * kLooks + look].seen;
      plain.keep_only(seen.universe() == plain.universe() ? seen : none);
    }
    std::vector<ObjectId> candidates;
    plain.for_each([&](ObjectId id) { candidates.push_back(id); });
    if (!candidates.empty())
      plants.push_back({cells[i], candidates[random.below(candidates.size())]});
  }
  return plants;
}

}  // namespace pvsfarm

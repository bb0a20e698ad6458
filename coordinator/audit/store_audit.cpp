#include "coordinator/audit/store_audit.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include "common/base/random.hpp"
#include "coordinator/audit/neighbours.hpp"

namespace pvsfarm {
namespace {

constexpr int kMaxPasses = 64;
constexpr std::uint64_t kFirstPassRays = 4'000'000, kFewestRays = 100, kMostRays = 400;
constexpr std::uint64_t kRaysASuspect = 16;  // half of a cell's rays are for its suspects
constexpr int kDoublings = 12;  // four times the rays with each pass, up to so many doublings
constexpr std::uint32_t kLeavesAnInner = 4;  // one inner cell is audited for so many leaves
constexpr std::size_t kRun = 64;             // leaves next to each other in the store
constexpr std::size_t kKeptBytes = 64u << 20;

VisibleSet united(const VisibleSet& a, const VisibleSet& b) {
  std::vector<std::uint64_t> words(a.words().begin(), a.words().end());
  for (std::size_t i = 0; i < words.size(); ++i) words[i] |= b.words()[i];
  return VisibleSet::from_words(a.universe(), std::move(words));
}

VisibleSet common(VisibleSet a, const VisibleSet& b) {
  a.keep_only(b);
  return a;
}

void shuffle(std::vector<std::uint32_t>& list, Random& random) {
  for (std::size_t i = list.size(); i > 1; --i) std::swap(list[i - 1], list[random.below(i)]);
}

// Runs of leaves change places: neighbours in the store are mostly neighbours in the scene, whose
// sets are read together, and a time that ends early has still been all over the store.
std::vector<std::uint32_t> shuffled_runs(const std::vector<std::uint32_t>& leaves, Random& random) {
  std::vector<std::uint32_t> runs((leaves.size() + kRun - 1) / kRun), list;
  std::iota(runs.begin(), runs.end(), 0u);
  shuffle(runs, random);
  for (const std::size_t run : runs) {
    const std::size_t end = std::min(leaves.size(), (run + 1) * kRun);
    for (std::size_t i = run * kRun; i < end; ++i) list.push_back(leaves[i]);
  }
  return list;
}

// Never one of the bake's own, which are drawn from the key alone.
std::uint64_t seed_for(std::uint64_t seed, int pass, const CellKey& key) {
  const std::uint64_t run =
      Random(seed ^ 0x6175646974ull).next() + static_cast<std::uint64_t>(pass);
  const std::uint64_t cell = Random(key.root * 0x9e3779b97f4a7c15ull ^ key.path).next();
  return Random(run).next() ^ cell;
}

}  // namespace

StoreAudit::StoreAudit(StoreReader& store, std::uint64_t seed)
    : store_(store), read_(store, kKeptBytes), seed_(seed) {}

Result<std::unique_ptr<StoreAudit>> StoreAudit::make(StoreReader& store, std::uint64_t seed) {
  std::unique_ptr<StoreAudit> audit(new StoreAudit(store, seed));
  auto objects = store.objects();
  if (!objects) return objects.error();
  audit->objects_ = std::move(objects).value();
  for (std::uint32_t i = 0; i < store.node_count(); ++i) {
    const auto node = store.node(i);
    if (!node) return node.error();
    (node->leaf ? audit->leaves_ : audit->inner_).push_back(i);
  }
  Random random(seed);
  audit->leaves_ = shuffled_runs(audit->leaves_, random);
  shuffle(audit->inner_, random);
  audit->reached_.assign(store.node_count(), 0);
  audit->answered_a_pass_.assign(kMaxPasses, 0);
  return audit;
}

std::uint32_t StoreAudit::inner_a_pass() const {
  const auto share = static_cast<std::uint32_t>(leaves_.size()) / kLeavesAnInner + 1;
  return std::min(static_cast<std::uint32_t>(inner_.size()), share);
}

std::uint32_t StoreAudit::count() const {
  const std::uint64_t all = kMaxPasses * (leaves_.size() + inner_a_pass());
  return static_cast<std::uint32_t>(
      std::min<std::uint64_t>(all, std::numeric_limits<std::uint32_t>::max()));
}

// A pass is all leaves, then the next few inner cells.
StoreAudit::Place StoreAudit::place_of(std::uint32_t number) const {
  const auto leaves = static_cast<std::uint32_t>(leaves_.size());
  const std::uint32_t a_pass = leaves + inner_a_pass();
  const std::uint32_t pass = number / a_pass, at = number % a_pass;
  if (at < leaves) return {static_cast<int>(pass), leaves_[at]};
  const std::uint64_t next = std::uint64_t{pass} * inner_a_pass() + (at - leaves);
  return {static_cast<int>(pass), inner_[next % inner_.size()]};
}

Result<StoredSets> StoreAudit::sets(std::uint32_t cell) {
  const auto read = read_.sets(cell);
  if (!read) return read.error();
  StoredSets sets = **read;
  if (const auto planted = plants_.find(cell); planted != plants_.end()) {
    for (const ObjectId object : planted->second) {
      sets.visible.remove(object);
      sets.seen.remove(object);
    }
  }
  return sets;
}

// The cells around a leaf, or the halves of a cell that was split.
Result<std::vector<std::uint32_t>> StoreAudit::cells_beside(const StoredNode& node) {
  if (node.leaf) return neighbours_of(store_, node);
  std::vector<std::uint32_t> halves;
  for (std::uint32_t i = node.index + 1; i < node.end;) {
    const auto half = store_.node(i);
    if (!half) return half.error();
    halves.push_back(i);
    i = half->end;
  }
  return halves;
}

// What a cell lacks although those beside it have it. `certified`: although they certainly see it;
// where they are certain of nothing, for no witnesses were sought, what they have must do.
Result<VisibleSet> StoreAudit::suspects(const StoredNode& node, const VisibleSet& visible,
                                        bool certified) {
  const auto beside = cells_beside(node);
  if (!beside) return beside.error();
  VisibleSet have = VisibleSet::none(store_.object_count()), see = have;
  for (const std::uint32_t other : *beside) {
    const auto theirs = sets(other);
    if (!theirs) return theirs.error();
    have = united(have, theirs->visible);
    see = united(see, theirs->seen);
  }
  VisibleSet lacking = certified && see.count() > 0 ? std::move(see) : std::move(have);
  lacking.remove_all(visible);
  return lacking;
}

// The first pass over a large store shall come to its end.
std::uint64_t StoreAudit::rays_for(int pass, std::uint64_t suspects) const {
  const std::uint64_t around =
      std::clamp(kFirstPassRays / (leaves_.size() + 1), kFewestRays, kMostRays);
  return (around + std::min(suspects * kRaysASuspect, 2 * around))
         << std::min(2 * pass, kDoublings);
}

Result<Question> StoreAudit::question(std::uint32_t number) {
  const Place place = place_of(number);
  const auto node = store_.node(place.cell);
  if (!node) return node.error();
  auto own = sets(place.cell);
  if (!own) return own.error();
  AuditQuestion question{.key = node->key, .cell = node->cell, .visible = std::move(own->visible)};
  Result<VisibleSet> suspected = suspects(*node, question.visible, place.pass == 0);
  if (!suspected) return suspected.error();
  question.suspects = std::move(suspected).value();
  question.seed = seed_for(seed_, place.pass, node->key);
  question.rays = rays_for(place.pass, question.suspects.count());
  return Question(std::move(question));
}

void StoreAudit::answered(std::uint32_t number, Finding finding) {
  const auto& audit = std::get<AuditFinding>(finding);
  const Place place = place_of(number);
  ++figures_.questions;
  figures_.rays += audit.rays;
  for (const AuditViolation& violation : audit.violations)
    violations_.try_emplace({place.cell, violation.object}, violation.line);
  const auto node = store_.node(place.cell);
  if (!node) return;  // its damage was, or will be, an error where it matters
  if (!reached_[place.cell]) {
    reached_[place.cell] = 1;
    ++(node->leaf ? figures_.leaves_reached : figures_.inner_reached);
  }
  if (!node->leaf) return;
  if (++answered_a_pass_[static_cast<std::size_t>(place.pass)] == leaves_.size()) ++figures_.passes;
  std::vector<std::byte>& seen = seen_[place.cell];
  if (seen.empty()) {
    seen = encode(audit.seen);
  } else if (const auto before = decode_visible_set(seen, store_.object_count())) {
    seen = encode(united(*before, audit.seen));
  }
}

AuditFigures StoreAudit::figures() const {
  AuditFigures figures = figures_;
  figures.leaves = static_cast<std::uint32_t>(leaves_.size());
  figures.inner = static_cast<std::uint32_t>(inner_.size());
  return figures;
}

std::vector<FoundViolation> StoreAudit::violations() const {
  std::vector<FoundViolation> list;
  for (const auto& [where, line] : violations_) list.push_back({where.first, where.second, line});
  return list;
}

Result<std::vector<CellGap>> StoreAudit::gaps() {
  std::vector<CellGap> gaps;
  newly_seen_ = 0;
  for (const auto& [cell, bytes] : seen_) {
    const auto stored = sets(cell);
    if (!stored) return stored.error();
    const auto audited = decode_visible_set(bytes, store_.object_count());
    if (!audited) return audited.error();
    const VisibleSet seen = common(united(stored->seen, *audited), stored->visible);
    newly_seen_ += seen.count() - common(stored->seen, stored->visible).count();
    gaps.push_back({cell, triangles_of(stored->visible, objects_), triangles_of(seen, objects_)});
  }
  std::sort(gaps.begin(), gaps.end(), [](const CellGap& a, const CellGap& b) {
    return std::pair(a.gap(), a.cell) < std::pair(b.gap(), b.cell);
  });
  return gaps;
}

}  // namespace pvsfarm

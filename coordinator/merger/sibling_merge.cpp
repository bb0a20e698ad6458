#include "coordinator/merger/sibling_merge.hpp"

#include <algorithm>

#include "common/base/check.hpp"

namespace pvsfarm {
namespace {

VisibleSet unpacked(const std::vector<std::byte>& bytes, const Tree& tree) {
  Result<VisibleSet> set = decode_visible_set(bytes, tree.object_count());
  PVS_CHECK(set.ok());  // our own encoding
  return std::move(set).value();
}

VisibleSet difference(VisibleSet set, const VisibleSet& without) {
  set.remove_all(without);
  return set;
}

// The subset of `whole` that is in a or b. Sets only shrink, so: whole minus what is in neither.
VisibleSet union_within(const VisibleSet& whole, const VisibleSet& a, const VisibleSet& b) {
  return difference(whole, difference(difference(whole, a), b));
}

class SubtreeMerge {
 public:
  SubtreeMerge(const Tree& tree, std::vector<SubtreeNode>& nodes)
      : tree_(tree), nodes_(nodes), facts_(nodes.size()) {}

  // Children stand after their parents: from the last to the first is bottom-up.
  void run() {
    for (std::size_t at = nodes_.size(); at-- > 0;)
      nodes_[at].node.leaf ? look_at_leaf(at) : look_at_split(at);
    std::size_t kept = 0;
    for (std::size_t at = 0; at < nodes_.size();
         at = nodes_[at].node.leaf ? facts_[at].end : at + 1)
      order_.push_back(at);
    for (const std::size_t at : order_) {
      if (kept != at) nodes_[kept] = std::move(nodes_[at]);
      ++kept;
    }
    nodes_.resize(kept);
  }

 private:
  // Of a leaf, or of all leaves that were merged into one.
  struct Facts {
    std::size_t end = 0;  // the node after its last descendant
    bool can_merge = false;
    std::uint64_t least_triangles = 0, most_triangles = 0;
  };

  void look_at_leaf(std::size_t at) {
    const bool can_merge = !nodes_[at].node.quarantined;
    facts_[at] = {at + 1, can_merge, 0, 0};
    if (!can_merge || tree_.subdivision().merge_tolerance < 0) return;
    const std::uint64_t triangles = tree_.triangles(unpacked(nodes_[at].visible, tree_));
    facts_[at].least_triangles = facts_[at].most_triangles = triangles;
  }

  void look_at_split(std::size_t at) {
    const std::size_t low = at + 1;
    PVS_CHECK_LT(low, nodes_.size());
    const std::size_t high = facts_[low].end;
    PVS_CHECK_LT(high, nodes_.size());
    facts_[at].end = facts_[high].end;
    const VisibleSet whole = unpacked(nodes_[at].visible, tree_);
    const VisibleSet a = unpacked(nodes_[low].visible, tree_);
    const VisibleSet b = unpacked(nodes_[high].visible, tree_);
    PVS_CHECK(a.subset_of(whole) && b.subset_of(whole));
    const VisibleSet both = union_within(whole, a, b);
    const VisibleSet seen = unpacked(nodes_[at].seen, tree_);
    nodes_[at].refuted = difference(seen, both).count();
    if (!agree(facts_[low], facts_[high], tree_.triangles(both))) return;

    SubtreeNode& node = nodes_[at];
    const VisibleSet seen_by_halves =
        union_within(both, unpacked(nodes_[low].seen, tree_), unpacked(nodes_[high].seen, tree_));
    if (!nodes_[low].hints.empty() || !nodes_[high].hints.empty())
      node.hints = united_hints(both, {a, nodes_[low].hints}, {b, nodes_[high].hints});
    node.visible = encode(both);
    node.seen = encode(union_within(both, seen_by_halves, seen));
    node.node.leaf = true;
    node.node.reason = LeafReason::kMerged;
    facts_[at].can_merge = true;
    facts_[at].least_triangles =
        std::min(facts_[low].least_triangles, facts_[high].least_triangles);
    facts_[at].most_triangles = std::max(facts_[low].most_triangles, facts_[high].most_triangles);
    for (const std::size_t half : {low, high}) {
      node.cost.add(nodes_[half].cost);
      node.parts += nodes_[half].parts + 1;
      node.refuted += nodes_[half].refuted;
    }
  }

  bool agree(const Facts& low, const Facts& high, std::uint64_t union_triangles) const {
    const SubdivisionSettings& settings = tree_.subdivision();
    if (settings.merge_tolerance < 0 || !low.can_merge || !high.can_merge) return false;
    const std::uint64_t least = std::min(low.least_triangles, high.least_triangles);
    const std::uint64_t most = std::max(low.most_triangles, high.most_triangles);
    if (union_triangles > settings.budget_triangles && most <= settings.budget_triangles)
      return false;
    return static_cast<double>(union_triangles) <=
           (1 + settings.merge_tolerance) * static_cast<double>(least);
  }

  const Tree& tree_;
  std::vector<SubtreeNode>& nodes_;
  std::vector<Facts> facts_;
  std::vector<std::size_t> order_;  // of the nodes that stay
};

// A cell's statistics count in fewer bits than the sums do, by the same names.
template <class From>
void add_figures(const From& from, CostFigures& sum) {
  sum.cpu_ms += from.cpu_ms;
  sum.contradictions += from.contradictions;
  for (std::size_t i = 0; i < sum.methods.size(); ++i) {
    const auto& method = from.methods[i];
    sum.methods[i].hidden_objects += method.hidden_objects;
    sum.methods[i].seen_objects += method.seen_objects;
    sum.methods[i].hidden_triangles += method.hidden_triangles;
    sum.methods[i].seen_triangles += method.seen_triangles;
    sum.methods[i].work += method.work;
    sum.methods[i].cpu_ms += method.cpu_ms;
  }
  sum.rounds.add(from.rounds);
}

}  // namespace

void CostFigures::add(const CellStatistics& statistics) { add_figures(statistics, *this); }
void CostFigures::add(const CostFigures& other) { add_figures(other, *this); }

void merge_siblings(const Tree& tree, std::vector<SubtreeNode>& subtree) {
  SubtreeMerge(tree, subtree).run();
}

}  // namespace pvsfarm

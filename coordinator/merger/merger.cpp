#include "coordinator/merger/merger.hpp"

namespace pvsfarm {

Result<CellDelta> decode_row(const ResultRow& row, std::uint32_t object_count) {
  Result<VisibleSet> hidden = decode_visible_set(row.hidden, object_count);
  if (!hidden) return hidden.error();
  Result<VisibleSet> seen = decode_visible_set(row.seen, object_count);
  if (!seen) return seen.error();
  return CellDelta{row.key,        std::move(*hidden), std::move(*seen), row.point_triangles,
                   row.statistics, row.hints};
}

Result<MergeAnswer> Merger::apply(const ResultRow& row) {
  if (tree_.is_open(row.key)) return merge_open(row, true);
  const Result<std::optional<Digest>> before = log_.find(row.key);
  if (!before) return before.error();
  if (!before->has_value()) return MergeAnswer{.outcome = MergeOutcome::kStale};
  const bool same = **before == delta_digest(row);
  return MergeAnswer{.outcome = same ? MergeOutcome::kDuplicate : MergeOutcome::kMismatch};
}

Result<MergeAnswer> Merger::replay(const ResultRow& row) {
  if (!tree_.is_open(row.key))
    return invalid_input("a result of a cell that this bake does not have");
  return merge_open(row, false);
}

// Two bytes for each object that the delta leaves.
bool Merger::hints_fit(const CellDelta& delta) const {
  VisibleSet left = tree_.decoded_parent(delta.key);
  if (delta.hidden.universe() != left.universe()) return false;
  left.remove_all(delta.hidden);
  return delta.hints.size() == 2 * std::size_t{left.count()};
}

Result<MergeAnswer> Merger::merge_open(const ResultRow& row, bool append) {
  Result<CellDelta> delta = decode_row(row, tree_.object_count());
  if (!delta) return delta.error();
  if (encode(delta->hidden) != row.hidden || encode(delta->seen) != row.seen)
    return invalid_input("delta whose bytes are not in canonical form");
  if (!row.hints.empty() && !hints_fit(*delta))
    return invalid_input("hints that do not fit their cell's set");
  const Result<Tree::Merged> merged = tree_.merge(*delta);
  if (!merged) return merged.error();
  if (append)
    if (Status status = log_.append(row); !status) return status.error();
  return MergeAnswer{MergeOutcome::kMerged, merged->split(), merged->visible.count(),
                     merged->triangles};
}

}  // namespace pvsfarm

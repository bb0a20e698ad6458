#include "coordinator/merger/merger.hpp"

namespace pvsfarm {

Result<MergeAnswer> Merger::apply(const ResultRow& row) {
  if (tree_.is_open(row.key)) return merge_open(row, true);
  const Result<std::optional<Digest>> before = log_.find(row.key);
  if (!before) return before.error();
  if (!before->has_value()) return MergeAnswer{.outcome = MergeOutcome::kStale};
  const bool same = **before == delta_digest(row.key, row.hidden);
  return MergeAnswer{.outcome = same ? MergeOutcome::kDuplicate : MergeOutcome::kMismatch};
}

Result<MergeAnswer> Merger::replay(const ResultRow& row) {
  if (!tree_.is_open(row.key))
    return invalid_input("a result of a cell that this bake does not have");
  return merge_open(row, false);
}

Result<MergeAnswer> Merger::merge_open(const ResultRow& row, bool append) {
  const Result<VisibleSet> hidden = decode_visible_set(row.hidden, tree_.object_count());
  if (!hidden) return hidden.error();
  if (encode(*hidden) != row.hidden)
    return invalid_input("delta whose bytes are not in canonical form");
  const Result<Tree::Merged> merged = tree_.merge(row.key, *hidden);
  if (!merged) return merged.error();
  if (append) {
    if (Status status = log_.append(row); !status)
      return Error{ErrorKind::kIo, status.error().text};
  }
  return MergeAnswer{MergeOutcome::kMerged, merged->split, merged->visible.count(),
                     merged->triangles};
}

}  // namespace pvsfarm

#include "coordinator/service/bake_work.hpp"

#include <utility>

namespace pvsfarm {

BakeWork::BakeWork(Tree& tree, ResultLog& log, Estimate estimate)
    : tree_(tree),
      log_(log),
      merger_(tree, log),
      disputes_(tree, log),
      estimate_(std::move(estimate)),
      opened_(tree.open_cells()) {}

std::vector<CellKey> BakeWork::take_open(std::size_t) { return std::exchange(opened_, {}); }

Result<Message> BakeWork::task(const BoardTask& task, SetShelf& shelf) {
  Task message{.lease = wire_id(task.lease), .attempt = task.attempt};
  std::map<const Bytes*, std::uint32_t> known;
  std::size_t inline_bytes = 0;
  for (const CellKey& key : task.cells) {
    SharedSet set;
    if (disputes_.holds(key)) {
      Result<SharedSet> once_more = disputes_.parent_set(key);
      if (!once_more) return once_more.error();
      set = std::move(once_more).value();
    } else {
      set = tree_.parent_set(key);
    }
    const auto [at, fresh] =
        known.emplace(set.get(), static_cast<std::uint32_t>(message.parents.size()));
    if (fresh) message.parents.push_back(shelf.place(set, inline_bytes));
    message.cells.push_back({key, *tree_.cell(key), at->second});
  }
  return Message(std::move(message));
}

Status BakeWork::accept(const WorkResult& result, WorkAnswer& answer) {
  const auto* begin = std::get_if<ResultBegin>(&result.head);
  if (begin == nullptr) {
    answer.outcome = ResultOutcome::kStale;  // the answer to another coordinator's question
    return {};
  }
  std::size_t offset = 0;
  for (const DeltaHead& head : begin->deltas) {
    ResultRow row{
        .key = head.key, .point_triangles = head.point_triangles, .statistics = head.statistics};
    const std::span<const std::byte> rest = std::span(result.data).subspan(offset);
    const auto hidden = rest.first(head.hidden_bytes);
    const auto seen = rest.subspan(head.hidden_bytes, head.seen_bytes);
    row.hidden.assign(hidden.begin(), hidden.end());
    row.seen.assign(seen.begin(), seen.end());
    const auto hints = rest.subspan(head.hidden_bytes + head.seen_bytes, head.hint_bytes);
    row.hints.assign(hints.begin(), hints.end());
    offset += head.set_bytes();
    if (Status status = merge(row, result, answer); !status) return status;
  }
  return {};
}

// The evaluator kept those objects visible, so the result stands; but a certificate was wrong.
void BakeWork::note_contradictions(const ResultRow& row, const std::string& worker,
                                   WorkAnswer& answer) {
  if (row.statistics.contradictions == 0) return;
  contradictions_ += row.statistics.contradictions;
  answer.warnings.push_back("A WITNESS REFUTES A CERTIFICATE: " + name_of(row.key) + ", " +
                            std::to_string(row.statistics.contradictions) + " objects, by " +
                            worker +
                            "; they stay visible, but this is a bug of pvsfarm: please report it");
}

Status BakeWork::merge(const ResultRow& row, const WorkResult& from, WorkAnswer& answer) {
  if (disputes_.holds(row.key)) return disputes_.hear(row, from, answer);
  const Result<MergeAnswer> merged = merger_.apply(row);
  if (!merged) return merged.error();
  switch (merged->outcome) {
    case MergeOutcome::kMerged:
      note_contradictions(row, from.worker, answer);
      disputes_.merged(row.key, from);
      answer.done.push_back({row.key, row.statistics.cpu_ms, merged->split});
      estimate_.done({row.key.depth(), row.statistics.cpu_ms, merged->split, true});
      result_bytes_ += row.hidden.size() + row.seen.size() + row.hints.size();
      for (int half = 0; merged->split && half < 2; ++half) {
        opened_.push_back(row.key.child(half));
        estimate_.opened(row.key.depth() + 1);
      }
      if (answer.outcome == ResultOutcome::kDuplicate) answer.outcome = ResultOutcome::kMerged;
      break;
    case MergeOutcome::kDuplicate:
      disputes_.merged(row.key, from);
      break;
    case MergeOutcome::kStale:
      if (answer.outcome != ResultOutcome::kMismatch) answer.outcome = ResultOutcome::kStale;
      break;
    case MergeOutcome::kMismatch:
      return disputes_.hear(row, from, answer);
  }
  return {};
}

std::string BakeWork::give_up(const CellKey& key) {
  if (disputes_.holds(key)) {
    disputes_.give_up(key);
    return "no third run of it; what either of two answers shows is kept";
  }
  tree_.give_up(key);
  estimate_.given_up(key.depth());
  given_up_.push_back(key);
  return "given up after repeated failures; it keeps its parent's set";
}

WorkProgress BakeWork::progress(Millis now) {
  WorkProgress progress{.figures = estimate_.at(now),
                        .result_bytes = result_bytes_,
                        .journal_bytes = log_.bytes(),
                        .given_up_count = given_up_.size()};
  const std::size_t named = std::min(given_up_.size(), kMaxNamedCells);
  progress.given_up.assign(given_up_.begin(),
                           given_up_.begin() + static_cast<std::ptrdiff_t>(named));
  return progress;
}

std::string BakeWork::name_of(const CellKey& key) const {
  return "cell " + std::to_string(key.root) + "/" + std::to_string(key.path);
}

std::string BakeWork::when_stopped() const {
  if (!keeps_) return "nothing is kept, as --no-resume asks";
  return "the journal keeps what is done, the same command goes on from there";
}

}  // namespace pvsfarm

#include "coordinator/service/disputes.hpp"

#include <algorithm>

#include "coordinator/merger/merger.hpp"

namespace pvsfarm {
namespace {

// Of the last so many results: copies of a task end soon after each other.
constexpr std::size_t kAuthors = 16'384;
constexpr std::size_t kRuns = 3;         // then, if nothing is decided, it never will be
constexpr std::size_t kMaxCases = 1024;  // then something else is wrong: they are counted only

std::string name_of(const CellKey& key) {
  return "cell " + std::to_string(key.root) + "/" + std::to_string(key.path);
}

}  // namespace

void Disputes::merged(const CellKey& key, const WorkResult& from) {
  if (!authors_.try_emplace(key, Author{from.id, from.lease}).second) return;
  authors_in_order_.push_back(key);
  if (authors_in_order_.size() <= kAuthors) return;
  authors_.erase(authors_in_order_.front());
  authors_in_order_.pop_front();
}

std::vector<CellKey> Disputes::cells() const {
  std::vector<CellKey> keys;
  for (const auto& [key, of] : cases_) keys.push_back(key);
  return keys;
}

// As the cells below it knew it: a row that was corrected since says less.
Result<std::optional<ResultRow>> Disputes::row_as_merged(const CellKey& key) {
  if (const auto found = cases_.find(key); found != cases_.end())
    return std::optional(found->second.runs.front().row);
  return log_.read(key);
}

Result<SharedSet> Disputes::parent_set(const CellKey& key) {
  const auto found = cases_.find(key);
  if (found != cases_.end() && found->second.parent) return found->second.parent;
  VisibleSet set = tree_.occludees();
  for (int up = key.depth(); up > 0; --up) {
    const CellKey ancestor{key.root, key.path >> up};
    const Result<std::optional<ResultRow>> row = row_as_merged(ancestor);
    if (!row) return row.error();
    if (!row->has_value())
      return Error{kDiskFailed, name_of(ancestor) + ": not in the journal, though cells below are"};
    const Result<CellDelta> delta = decode_row(**row, tree_.object_count());
    if (!delta) return delta.error();
    set.remove_all(delta->hidden);
  }
  auto bytes = std::make_shared<const Bytes>(encode(set));
  if (found != cases_.end()) found->second.parent = bytes;
  return SharedSet(std::move(bytes));
}

// What the tree asks of a delta, asked of one that it never sees.
Status Disputes::check(const CellKey& key, Case& now, const CellDelta& delta) {
  if (!now.parent) {
    Result<SharedSet> parent = parent_set(key);
    if (!parent) return parent.error();
    now.parent = std::move(parent).value();
  }
  Result<VisibleSet> visible = decode_visible_set(*now.parent, tree_.object_count());
  if (!visible) return visible.error();
  if (!delta.hidden.subset_of(*visible))
    return invalid_input("delta hides objects that the parent's set does not hold");
  visible->remove_all(delta.hidden);
  if (!delta.seen.subset_of(*visible))
    return invalid_input("delta has seen objects that the cell's set does not hold");
  return {};
}

// The result that was merged.
Status Disputes::begin(const CellKey& key, Case& now) {
  Result<std::optional<ResultRow>> row = log_.read(key);
  if (!row) return row.error();
  if (!row->has_value()) return Error{kDiskFailed, name_of(key) + ": not in the journal"};
  Result<CellDelta> delta = decode_row(**row, tree_.object_count());
  if (!delta) return delta.error();
  Run first{delta_digest(**row), std::move(**row), std::move(delta).value(), {}};
  const auto author = authors_.find(key);
  // Of one who is not known it is said that somebody else brought it: nobody has the number 0.
  first.by.insert(author == authors_.end() ? WorkerId{} : author->second.worker);
  if (author != authors_.end()) now.leases.insert(author->second.lease);
  now.runs.push_back(std::move(first));
  return {};
}

Status Disputes::hear(const ResultRow& row, const WorkResult& from, WorkAnswer& answer) {
  const CellKey& key = row.key;
  answer.outcome = ResultOutcome::kMismatch;
  Case fresh;
  const bool known = holds(key);
  if (!known) {
    ++figures_.disputes;
    if (cases_.size() >= kMaxCases) return {};
    if (Status status = begin(key, fresh); !status) return status;
  }
  Case& now = known ? cases_.at(key) : fresh;
  // The same run told again, or one that comes when all is said.
  if (!now.open || !now.leases.insert(from.lease).second) return {};
  ++now.heard;
  Result<CellDelta> delta = decode_row(row, tree_.object_count());
  if (!delta) return delta.error();
  if (Status status = check(key, now, *delta); !status) return status;

  const Digest digest = delta_digest(row);
  auto run = std::find_if(now.runs.begin(), now.runs.end(),
                          [&](const Run& other) { return other.digest == digest; });
  if (run == now.runs.end())
    run = now.runs.insert(now.runs.end(), Run{digest, row, std::move(delta).value(), {}});
  run->by.insert(from.id);
  if (run->by.size() >= 2) return settle(key, now, &*run, answer);
  if (now.heard >= kRuns) return settle(key, now, nullptr, answer);
  if (known) return {};

  answer.warnings.push_back("two workers disagree on " + name_of(key) + ", the second is " +
                            from.worker + "; a third run decides");
  std::vector<WorkerId> avoid(now.runs.front().by.begin(), now.runs.front().by.end());
  avoid.push_back(from.id);
  answer.again.push_back({key, std::move(avoid)});
  const Status written = write(key, now, nullptr);
  cases_.emplace(key, std::move(fresh));
  return written;
}

// The row that the store will be made of.
Status Disputes::write(const CellKey& key, const Case& now, const Run* decided) {
  const Run& first = now.runs.front();
  if (decided == &first) return log_.replace(first.row);
  ResultRow row{.key = key, .point_triangles = first.row.point_triangles};
  row.statistics = first.row.statistics;
  VisibleSet hidden = first.delta.hidden, seen = (decided ? *decided : first).delta.seen;
  for (const Run& run : now.runs) {
    if (decided != nullptr && &run != decided) continue;
    hidden.keep_only(run.delta.hidden);
    seen.keep_only(run.delta.seen);
    row.point_triangles = std::min(row.point_triangles, run.row.point_triangles);
  }
  row.hidden = encode(hidden);
  row.seen = encode(seen);
  return log_.replace(row);
}

Status Disputes::settle(const CellKey& key, Case& now, const Run* decided, WorkAnswer& answer) {
  now.open = false;
  answer.checked.push_back(key);
  const bool for_first = decided == &now.runs.front();
  ++(decided == nullptr ? figures_.undecided
     : for_first        ? figures_.for_first
                        : figures_.against_first);
  answer.warnings.push_back(
      name_of(key) + (decided == nullptr
                          ? ": the third run decides nothing; what any of the answers shows is kept"
                      : for_first ? ": the third run agrees with the first, whose result stands"
                                  : ": the third run agrees with the second; the first was wrong"));
  if (decided != nullptr)
    for (const Run& run : now.runs)
      for (const WorkerId worker : run.by)
        if (&run != decided && worker != WorkerId{}) answer.wrong.push_back({worker, key});
  const Status written = write(key, now, decided);
  for (Run& run : now.runs) run.delta = {};
  return written;
}

void Disputes::give_up(const CellKey& key) {
  Case& now = cases_.at(key);
  if (now.open) ++figures_.undecided;
  now.open = false;
}

}  // namespace pvsfarm

#include "coordinator/service/inquiry_work.hpp"

#include <algorithm>
#include <utility>

#include "common/wire/finding_bytes.hpp"

namespace pvsfarm {
namespace {

constexpr std::size_t kOpenAhead = 2048;  // questions on the board that no worker has yet

enum Kind : std::size_t { kAudit, kExplain, kEvaluate };  // Question::index()

// The board knows questions by their number, written as a key.
CellKey key_of(std::uint32_t number) { return {.root = number}; }

}  // namespace

// The sets of one message: placed once where they are equal to the one before.
class InquiryWork::Sets {
 public:
  Sets(std::vector<ParentSet>& out, std::vector<SharedSet>& kept, SetShelf& shelf)
      : out_(out), kept_(kept), shelf_(shelf) {}

  std::uint32_t place(const VisibleSet& set) {
    Bytes bytes = encode(set);
    if (!last_ || *last_ != bytes) {
      last_ = std::make_shared<const Bytes>(std::move(bytes));
      out_.push_back(shelf_.place(last_, inline_bytes_));
      if (out_.back().set_bytes != 0) kept_.push_back(last_);
    }
    return static_cast<std::uint32_t>(out_.size() - 1);
  }

 private:
  std::vector<ParentSet>& out_;
  std::vector<SharedSet>& kept_;
  SetShelf& shelf_;
  SharedSet last_;
  std::size_t inline_bytes_ = 0;
};

bool QuestionList::together(std::uint32_t first, std::uint32_t next) const {
  const Question &a = questions_[first], &b = questions_[next];
  if (a.index() != b.index() || a.index() == kExplain) return false;
  return a.index() == kAudit || std::get<kEvaluate>(a).settings == std::get<kEvaluate>(b).settings;
}

std::vector<CellKey> InquiryWork::take_open(std::size_t pending) {
  std::vector<CellKey> keys;
  for (std::size_t i = pending; i < kOpenAhead && next_ < source_.count(); ++i) {
    open_.insert(next_);
    estimate_.opened(0);
    keys.push_back(key_of(next_++));
  }
  return keys;
}

bool InquiryWork::together(const CellKey& first, const CellKey& next) const {
  return source_.together(first.root, next.root);
}

Status InquiryWork::fill(Inquiry& message, const Question& question, Sets& sets) const {
  if (const auto* audit = std::get_if<AuditQuestion>(&question)) {
    message.audits.push_back({audit->key, audit->cell, sets.place(audit->visible),
                              sets.place(audit->suspects), audit->seed, audit->rays});
    return {};
  }
  const auto& explain = std::get<ExplainQuestion>(question);
  message.explain = {explain.key, explain.cell, sets.place(explain.parent), explain.object};
  return {};
}

Result<Message> InquiryWork::task(const BoardTask& task, SetShelf& shelf) {
  Handed& handed = handed_[wire_id(task.lease)];
  Inquiry inquiry{.lease = wire_id(task.lease), .attempt = task.attempt};
  Task evaluation{.lease = inquiry.lease, .attempt = task.attempt};
  Sets sets(inquiry.sets, handed.sets, shelf);
  for (const CellKey& key : task.cells) {
    const Result<Question> question = source_.question(key.root);
    if (!question) return question.error();
    handed.kind = question->index();
    handed.numbers.push_back(key.root);
    handed.cells.push_back(std::visit([](const auto& asked) { return asked.key; }, *question));
    if (const auto* cell = std::get_if<EvaluateQuestion>(&*question)) {
      evaluation.cells.push_back({cell->key, cell->cell, sets.place(cell->parent)});
      evaluation.settings = cell->settings;
    } else if (Status status = fill(inquiry, *question, sets); !status) {
      return status.error();
    }
  }
  if (handed.kind != kEvaluate) return Message(std::move(inquiry));
  evaluation.parents = std::move(inquiry.sets);
  return Message(std::move(evaluation));
}

Status InquiryWork::accept(const WorkResult& result, WorkAnswer& answer) {
  const auto found = handed_.find(result.lease);
  if (found == handed_.end()) {
    answer.outcome = ResultOutcome::kStale;  // of another coordinator
    return {};
  }
  Handed& handed = found->second;
  const auto take_all = [&](const auto& heads) -> Status {
    if (heads.size() > handed.numbers.size()) return invalid_input("more answers than questions");
    std::span<const std::byte> rest = result.data;
    for (std::size_t i = 0; i < heads.size(); ++i) {
      const auto& head = heads[i];
      std::uint64_t bytes = 0;
      if constexpr (std::is_same_v<std::decay_t<decltype(head)>, FindingHead>)
        bytes = head.bytes;
      else
        bytes = head.set_bytes();
      if (Status status = take(handed, i, head, rest.first(bytes), answer); !status) return status;
      rest = rest.subspan(bytes);
    }
    return {};
  };
  handed.sets.clear();
  result_bytes_ += result.data.size();
  const auto* findings = std::get_if<FindingBegin>(&result.head);
  if ((findings == nullptr) != (handed.kind == kEvaluate))
    return invalid_input("the answer to another kind of question");
  return findings != nullptr ? take_all(findings->findings)
                             : take_all(std::get<ResultBegin>(result.head).deltas);
}

Status InquiryWork::take(const Handed& handed, std::size_t i, const FindingHead& head,
                         std::span<const std::byte> data, WorkAnswer& answer) {
  Result<WireFinding> finding = decode_finding(data, object_count_);
  if (!finding) return finding.error();
  if (finding->index() != handed.kind) return invalid_input("the answer to another question");
  if (auto* audit = std::get_if<AuditFinding>(&*finding)) {
    if (audit->key != handed.cells[i]) return invalid_input("the audit of another cell");
    settle(handed.numbers[i], std::move(*audit), head.cpu_ms, answer);
  } else {
    settle(handed.numbers[i], std::get<ExplainFinding>(std::move(finding).value()), head.cpu_ms,
           answer);
  }
  return {};
}

Status InquiryWork::take(const Handed& handed, std::size_t i, const DeltaHead& head,
                         std::span<const std::byte> data, WorkAnswer& answer) {
  if (head.key != handed.cells[i]) return invalid_input("the delta of another cell");
  Result<VisibleSet> hidden = decode_visible_set(data.first(head.hidden_bytes), object_count_);
  if (!hidden) return hidden.error();
  Result<VisibleSet> seen = decode_visible_set(data.subspan(head.hidden_bytes), object_count_);
  if (!seen) return seen.error();
  settle(handed.numbers[i],
         CellDelta{head.key, std::move(*hidden), std::move(*seen), head.point_triangles,
                   head.statistics},
         head.statistics.cpu_ms, answer);
  return {};
}

// An answer that is the first to its question counts; all are equal, whoever gave them.
void InquiryWork::settle(std::uint32_t number, Finding finding, double cost_ms,
                         WorkAnswer& answer) {
  if (open_.erase(number) == 0) return;
  ++answered_;
  estimate_.done({.cost_ms = cost_ms});
  answer.done.push_back({key_of(number), cost_ms});
  answer.outcome = ResultOutcome::kMerged;
  source_.answered(number, std::move(finding));
}

std::string InquiryWork::give_up(const CellKey& key) {
  open_.erase(key.root);
  estimate_.given_up(0);
  ++given_up_;
  source_.given_up(key.root);
  return "given up after repeated failures";
}

WorkProgress InquiryWork::progress(Millis now) {
  WorkProgress progress{estimate_.at(now), result_bytes_};
  progress.figures.cells_expected = static_cast<double>(source_.count());
  return progress;
}

std::string InquiryWork::name_of(const CellKey& key) const {
  return "question " + std::to_string(key.root);
}

}  // namespace pvsfarm

// Questions to a farm beside the bake: audits, explanations, measurements. Each is answered exactly
// once, or given up after repeated failures; nothing is kept when the coordinator ends.
// Threads: one.
#pragma once

#include <set>
#include <unordered_map>

#include "common/pvs/inquiry.hpp"
#include "coordinator/service/work.hpp"

namespace pvsfarm {

// Asks and listens. Questions are known by their number, 0 .. count() - 1, and asked about in this
// order, though not answered in it.
class InquirySource {
 public:
  virtual ~InquirySource() = default;
  // May grow while answers come in. [limit] 2^32 - 1
  virtual std::uint32_t count() const = 0;
  // The same for the same number: it may be asked several times. Errors: end the whole inquiry.
  virtual Result<Question> question(std::uint32_t number) = 0;
  // Whether both may be in one task: of one kind, neither an explanation, with the same settings.
  virtual bool together(std::uint32_t first, std::uint32_t next) const = 0;
  virtual void answered(std::uint32_t number, Finding finding) = 0;
  virtual void given_up(std::uint32_t number) = 0;
};

// A list of questions of any kind, and one listener.
class QuestionList : public InquirySource {
 public:
  using Listener = std::function<void(std::uint32_t number, Finding finding)>;
  QuestionList(std::vector<Question> questions, Listener listener)
      : questions_(std::move(questions)), listener_(std::move(listener)) {}

  std::uint32_t count() const override { return static_cast<std::uint32_t>(questions_.size()); }
  Result<Question> question(std::uint32_t number) override { return questions_[number]; }
  bool together(std::uint32_t first, std::uint32_t next) const override;
  void answered(std::uint32_t number, Finding finding) override {
    listener_(number, std::move(finding));
  }
  void given_up(std::uint32_t number) override { failures_.push_back(number); }
  const std::vector<std::uint32_t>& failures() const { return failures_; }

 private:
  std::vector<Question> questions_;
  Listener listener_;
  std::vector<std::uint32_t> failures_;
};

class InquiryWork : public Work {
 public:
  // `source` outlives the work. Sets in answers are of `object_count` objects.
  InquiryWork(InquirySource& source, std::uint32_t object_count)
      : source_(source), object_count_(object_count) {}

  std::vector<CellKey> take_open(std::size_t pending) override;
  bool together(const CellKey& first, const CellKey& next) const override;
  Result<Message> task(const BoardTask& task, SetShelf& shelf) override;
  Status accept(const WorkResult& result, WorkAnswer& answer) override;
  std::string give_up(const CellKey& key) override;
  WorkProgress progress(Millis now) override;
  std::string name_of(const CellKey& key) const override;
  std::string when_stopped() const override { return "what was answered until then counts"; }

  std::uint64_t answered() const { return answered_; }
  std::uint64_t given_up() const { return given_up_; }

 private:
  // What went to a worker under one lease. Kept to the end: a lease that ran out may be answered.
  struct Handed {
    std::vector<std::uint32_t> numbers;
    std::vector<CellKey> cells;   // of the questions, for comparison
    std::size_t kind = 0;         // Question::index()
    std::vector<SharedSet> sets;  // that are on the shelf
  };
  class Sets;

  Status fill(Inquiry& message, const Question& question, Sets& sets) const;
  Status take(const Handed& handed, std::size_t i, const DeltaHead& head,
              std::span<const std::byte> data, WorkAnswer& answer);
  Status take(const Handed& handed, std::size_t i, const FindingHead& head,
              std::span<const std::byte> data, WorkAnswer& answer);
  void settle(std::uint32_t number, Finding finding, double cost_ms, WorkAnswer& answer);

  InquirySource& source_;
  std::uint32_t object_count_;
  std::uint32_t next_ = 0;        // the lowest number that was never on the board
  std::set<std::uint32_t> open_;  // on the board
  std::map<LeaseId, Handed> handed_;
  Estimate estimate_;
  std::uint64_t answered_ = 0, given_up_ = 0, result_bytes_ = 0;
};

}  // namespace pvsfarm

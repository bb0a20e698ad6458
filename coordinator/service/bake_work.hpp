// The bake: cells from the tree, deltas to the merger and the log, two new cells for each split.
// Threads: one.
#pragma once

#include "coordinator/merger/merger.hpp"
#include "coordinator/service/disputes.hpp"
#include "coordinator/service/work.hpp"

namespace pvsfarm {

class BakeWork : public Work {
 public:
  // `tree` and `log` outlive the work. The tree's open cells are what is to be done.
  BakeWork(Tree& tree, ResultLog& log, Estimate estimate);

  std::vector<CellKey> take_open(std::size_t pending) override;
  Result<Message> task(const BoardTask& task, SetShelf& shelf) override;
  Status accept(const WorkResult& result, WorkAnswer& answer) override;
  std::string give_up(const CellKey& key) override;
  std::size_t uncommitted() const override { return log_.uncommitted(); }
  bool adopts() const override { return true; }
  Status commit() override { return log_.commit(); }
  bool disk_full() const override { return log_.disk_full(); }
  Status keep_kernel(const std::string& kernel) override { return log_.set_kernel(kernel); }
  WorkProgress progress(Millis now) override;
  std::string name_of(const CellKey& key) const override;
  std::string when_stopped() const override;
  void keeps_nothing() { keeps_ = false; }  // its log goes with it

  // Cells of which a second result had other bytes than the first.
  std::uint64_t disagreements() const { return disputes_.figures().disputes; }
  const Disputes& disputes() const { return disputes_; }
  // Objects that a witness showed although a certificate hid them, of the results since the start.
  std::uint64_t contradictions() const { return contradictions_; }
  const std::vector<CellKey>& given_up() const { return given_up_; }

 private:
  void note_contradictions(const ResultRow& row, const std::string& worker, WorkAnswer& answer);
  Status merge(const ResultRow& row, const WorkResult& from, WorkAnswer& answer);

  Tree& tree_;
  ResultLog& log_;
  Merger merger_;
  Disputes disputes_;
  Estimate estimate_;
  std::vector<CellKey> opened_, given_up_;
  std::uint64_t result_bytes_ = 0;
  std::uint64_t contradictions_ = 0;
  bool keeps_ = true;
};

}  // namespace pvsfarm

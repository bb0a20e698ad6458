// The journal of a bake: an SQLite file beside the output, which makes a killed coordinator lose
// nothing that it acknowledged.
//
// Shape: WAL, synchronous=FULL, one exclusive connection. Rows of one bake only: scene, cells,
// settings and algorithm are bound by a digest. A file that is refused is not written to, and
// neither is one that is taken before the first commit(). Appended rows wait in memory, so that a
// commit that found the disk full can be repeated.
// Threads: one.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "coordinator/journal/result_log.hpp"

namespace pvsfarm {

struct JournalBinding {
  Digest bake;           // of scene, cells, settings, algorithm version
  std::string settings;  // for people: compared with the journal's to say what differs
};

class Journal : public ResultLog {
 public:
  // Opens the bake's journal, or makes it. Errors: kIo (folder, rights, disk; held by another
  // process), kInvalidInput (not a journal, damaged, of another bake), each with the way out.
  static Result<std::unique_ptr<Journal>> open(const std::string& path,
                                               const JournalBinding& binding);
  // Errors: kIo, if a process has a journal there.
  static Status check_free(const std::string& path);
  // Removes a journal whatever it holds. No file is no error. Errors: kIo; also if a process has
  // it.
  static Status discard(const std::string& path);

  ~Journal() override;

  Result<std::optional<Digest>> find(const CellKey& key) override;
  Result<std::optional<ResultRow>> read(const CellKey& key) override;
  Status append(const ResultRow& row) override;
  Status replace(const ResultRow& row) override;
  std::size_t uncommitted() const override;
  Status commit() override;
  bool disk_full() const override;

  // Pages that the -wal file holds before they go to the main one; tests take few.
  void checkpoint_every(int pages);
  std::uint64_t bytes() const override;

  // The kernel whose results the journal holds; "" before the first worker.
  Result<std::string> kernel() const;
  Status set_kernel(const std::string& kernel) override;

  std::uint64_t row_count() const;  // with those that were not committed
  // Every committed row in CellKey order, until `visit` fails. Errors: kIo, kInvalidInput
  // (damaged).
  Status for_each(const std::function<Status(ResultRow)>& visit) const;

  // Closes and removes the file: its results are in the store.
  Status remove();

 private:
  struct State;
  explicit Journal(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm

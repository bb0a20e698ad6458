// The journal of a bake: an SQLite file beside the output, which makes a killed coordinator lose
// nothing that it acknowledged.
//
// Shape: WAL, synchronous=FULL, one exclusive connection. Rows of one bake only: scene, cells,
// settings and algorithm are bound by a digest, and another bake's journal is refused untouched.
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
  // Removes a journal whatever it holds. No file is no error.
  static Status discard(const std::string& path);

  ~Journal() override;

  Result<std::optional<Digest>> find(const CellKey& key) override;
  Status append(const ResultRow& row) override;
  std::size_t uncommitted() const override;
  Status commit() override;

  // The kernel whose results the journal holds; "" before the first worker.
  Result<std::string> kernel() const;
  Status set_kernel(const std::string& kernel) override;

  std::uint64_t row_count() const;
  // Every committed and uncommitted row in CellKey order, until `visit` fails.
  Status for_each(const std::function<Status(ResultRow)>& visit) const;

  // Closes and removes the file: its results are in the store.
  Status remove();

 private:
  struct State;
  explicit Journal(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm

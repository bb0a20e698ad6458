// A bake as a file for trace viewers (Perfetto, chrome://tracing): one line a worker with its tasks
// as spans, commits to the journal, the queue's depth and the number of workers as counters.
//
// Shape: Chrome's JSON array of events, one a line. Its closing bracket may be missing by that
// format's own rule, so the file of a killed bake opens too; what the last moment did is not in it.
// Threads: one.
#pragma once

#include <chrono>
#include <cstdio>
#include <map>
#include <memory>
#include <string>

#include "coordinator/service/events.hpp"

namespace pvsfarm {

class Trace : public FarmEvents {
 public:
  // Errors: kIo.
  static Result<std::unique_ptr<Trace>> create(const std::string& path);
  ~Trace() override;

  // What there was before the first worker: `cells` to begin with, so many of them done already.
  struct Start {
    std::uint64_t root_cells = 0;
    std::string output;
  };
  void start(const Start& start);
  // Once: closes the file. Errors: kIo, if anything could not be written.
  Status finish();

  void worker_joined(WorkerId worker, const Hello& hello) override;
  void worker_left(WorkerId worker, bool lost) override;
  void task_given(WorkerId worker, const BoardTask& task) override;
  void task_ended(BoardLease lease, End end, std::span<const WorkAnswer::Done> done,
                  const std::string& text) override;
  void commit_begins(std::size_t rows) override;
  void commit_ends() override;
  void queue(const Queue& queue) override;

 private:
  using Clock = std::chrono::steady_clock;
  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  struct Given {
    WorkerId worker{};
    CellKey first;
    std::size_t cells = 0;
    unsigned attempt = 0;
    std::int64_t at_us = 0;
  };

  explicit Trace(std::string path, std::FILE* file) : path_(std::move(path)), file_(file) {}
  std::int64_t now_us() const;
  void put(const std::string& line);  // one event, without the comma

  std::string path_;
  std::unique_ptr<std::FILE, CloseFile> file_;
  Clock::time_point start_ = Clock::now();
  std::int64_t flushed_us_ = 0, queue_us_ = -1, commit_us_ = 0;
  std::size_t commit_rows_ = 0;
  Queue queue_;  // as last written
  bool first_ = true;
  std::map<BoardLease, Given> given_;
  std::map<WorkerId, std::int64_t> free_us_;  // when its last task ended
};

}  // namespace pvsfarm

// The computing thread: one task at a time, behind the messenger's back. If it hangs or crawls, the
// messenger goes on telling so.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "common/pvs/delta.hpp"
#include "common/scene/scene.hpp"
#include "worker/service/messenger.hpp"

namespace pvsfarm {

// Evaluates one cell; always called on the thread that made it.
using EvaluateCell = std::function<CellDelta(const CellKey&, const Cell&, const VisibleSet&)>;
// Makes an evaluator for a scene, on the computing thread.
using MakeEvaluator =
    std::function<EvaluateCell(std::shared_ptr<const Scene>, const EvaluatorSettings&)>;

// Processor time of the calling thread.
double thread_cpu_ms();

// Threads: all members from one thread, the messenger's.
class Compute {
 public:
  explicit Compute(MakeEvaluator make_evaluator);
  // If the thread does not end within a second, it is left behind: the process is about to end.
  ~Compute();
  Compute(const Compute&) = delete;
  Compute& operator=(const Compute&) = delete;

  // From the next task on. Requires: idle.
  void use(std::shared_ptr<const Scene> scene, const EvaluatorSettings& settings);
  bool idle() const { return !running_; }
  void start(Job job);  // Requires: idle, a scene is in use
  // Grows while the task advances; 1 as soon as it has begun.
  std::uint64_t progress() const;
  void cancel();  // the running task: what is complete so far becomes its result
  std::optional<JobResult> take_result();
  int ready_fd() const;  // readable when there is a result

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
  std::thread thread_;
  bool running_ = false;
};

}  // namespace pvsfarm

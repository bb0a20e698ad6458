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
#include "common/pvs/inquiry.hpp"
#include "common/scene/scene.hpp"
#include "worker/service/messenger.hpp"

namespace pvsfarm {

using EvaluateCell = std::function<CellDelta(const CellKey&, const Cell&, const VisibleSet&)>;
using AnswerAudit = std::function<AuditFinding(const AuditQuestion&)>;
using AnswerExplain = std::function<ExplainFinding(const ExplainQuestion&)>;
// What a worker can compute. Everything is made and called on the computing thread, when it is
// first needed, and lives as long as the scene (an evaluator and an explainer: as long as their
// settings).
struct Workshop {
  using Scenery = std::shared_ptr<const Scene>;
  std::function<EvaluateCell(Scenery, const EvaluatorSettings&)> make_evaluator;
  std::function<AnswerAudit(Scenery, const EvaluatorSettings&)> make_auditor;
  std::function<AnswerExplain(Scenery, const EvaluatorSettings&)> make_explainer;
  std::function<void()> begin_thread;  // first of all, on the computing thread; may be empty
  bool has_osmesa = false;             // a task whose settings need it fails without
};

// Processor time of the calling thread.
double thread_cpu_ms();

// Threads: all members from one thread, the messenger's.
class Compute {
 public:
  explicit Compute(Workshop workshop);
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
  class Bench;
  std::shared_ptr<Shared> shared_;
  std::thread thread_;
  bool running_ = false;
};

}  // namespace pvsfarm

#include "worker/service/compute.hpp"

#include <sys/eventfd.h>
#include <time.h>
#include <unistd.h>

#include <exception>
#include <new>

#include "common/base/check.hpp"
#include "common/pvs/occludees.hpp"
#include "common/wire/finding_bytes.hpp"

namespace pvsfarm {

struct Compute::Shared {
  Workshop workshop;
  int event = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  std::mutex mutex;
  std::condition_variable changed;
  // Guarded by the mutex.
  std::shared_ptr<const Scene> scene;
  EvaluatorSettings settings;
  bool scene_changed = false;
  std::optional<Job> job;
  std::optional<JobResult> result;
  bool stop = false, stopped = false;

  std::atomic<std::uint64_t> progress{0};
  std::atomic<bool> cancelled{false};

  ~Shared() { close(event); }
  void run();
};

double thread_cpu_ms() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_nsec) / 1e6;
}

namespace {

// Appends a set's canonical bytes; their number.
std::uint64_t append(const VisibleSet& set, Bytes& data) {
  const Bytes bytes = encode(set);
  data.insert(data.end(), bytes.begin(), bytes.end());
  return bytes.size();
}

bool needs_osmesa(const EvaluatorSettings& settings) {
  return settings.raster == RasterKind::kOsmesa || settings.methods.has(Method::kItemBuffers);
}

JobResult failed(LeaseId lease, FailureKind kind, std::string text) {
  JobResult result{.lease = lease};
  result.failure = TaskFailed{lease, kind, std::move(text)};
  return result;
}

}  // namespace

// One scene's tools, made when they are needed. Lives on the computing thread.
class Compute::Bench {
 public:
  Bench(const Shared& shared, std::shared_ptr<const Scene> scene, const EvaluatorSettings& settings)
      : shared_(shared),
        workshop_(shared.workshop),
        scene_(std::move(scene)),
        settings_(settings),
        everything_(all_occludees(*scene_)) {}

  JobResult work(const Job& job, std::atomic<std::uint64_t>& progress) {
    if (const auto* task = std::get_if<Task>(&job.work)) return evaluate(*task, progress);
    return answer(std::get<Inquiry>(job.work), progress);
  }

 private:
  std::optional<VisibleSet> set_of(const ParentSet& parent) const {
    if (parent.all) return everything_;
    Result<VisibleSet> set = decode_visible_set(parent.set, everything_.universe());
    if (!set || set->universe() != everything_.universe()) return std::nullopt;
    return std::move(set).value();
  }

  JobResult evaluate(const Task& task, std::atomic<std::uint64_t>& progress);
  JobResult answer(const Inquiry& inquiry, std::atomic<std::uint64_t>& progress);
  JobResult explain(const Inquiry& inquiry);

  const Shared& shared_;
  const Workshop& workshop_;
  std::shared_ptr<const Scene> scene_;
  EvaluatorSettings settings_;  // of the bake
  VisibleSet everything_;
  EvaluateCell evaluate_;
  EvaluatorSettings evaluate_settings_;  // of evaluate_
  AnswerAudit audit_;
  AnswerExplain explain_;
};

JobResult Compute::Bench::evaluate(const Task& task, std::atomic<std::uint64_t>& progress) {
  const EvaluatorSettings& settings = task.settings ? *task.settings : settings_;
  if (needs_osmesa(settings) && !workshop_.has_osmesa)
    return failed(task.lease, FailureKind::kDeterministic, "this worker has no OSMesa");
  std::vector<VisibleSet> parents;
  for (const ParentSet& parent : task.parents) {
    std::optional<VisibleSet> set = set_of(parent);
    if (!set)
      return failed(task.lease, FailureKind::kTransient, "a parent set does not fit the scene");
    parents.push_back(std::move(*set));
  }
  if (!evaluate_ || evaluate_settings_ != settings) {
    evaluate_ = nullptr;  // the old one goes before the new one comes
    explain_ = nullptr;   // OSMesa: one at a time
    evaluate_ = workshop_.make_evaluator(scene_, settings);
    evaluate_settings_ = settings;
  }
  JobResult answer{.lease = task.lease};
  for (const TaskCell& cell : task.cells) {
    if (shared_.cancelled) break;
    const double before_ms = thread_cpu_ms();
    const CellDelta delta = evaluate_(cell.key, cell.cell, parents[cell.parent]);
    DeltaHead head{
        .key = cell.key, .point_triangles = delta.point_triangles, .statistics = delta.statistics};
    head.statistics.cpu_ms = thread_cpu_ms() - before_ms;
    head.hidden_bytes = append(delta.hidden, answer.data);
    head.seen_bytes = append(delta.seen, answer.data);
    head.hint_bytes = delta.hints.size();
    answer.data.insert(answer.data.end(), delta.hints.begin(), delta.hints.end());
    answer.deltas.push_back(head);
    ++progress;
  }
  if (answer.deltas.empty()) return failed(task.lease, FailureKind::kTransient, "cancelled");
  if (answer.data.size() > kMaxResultBytes)
    return failed(task.lease, FailureKind::kDeterministic, "a result over its size limit");
  return answer;
}

JobResult Compute::Bench::explain(const Inquiry& inquiry) {
  const ExplainAsked& asked = *inquiry.explain;
  std::optional<VisibleSet> parent = set_of(inquiry.sets[asked.parent]);
  if (!parent || index_of(asked.object) >= parent->universe() || !parent->contains(asked.object))
    return failed(inquiry.lease, FailureKind::kDeterministic,
                  "the question does not fit the scene");
  if (needs_osmesa(settings_) && !workshop_.has_osmesa)
    return failed(inquiry.lease, FailureKind::kDeterministic, "this worker has no OSMesa");
  if (!explain_) {
    evaluate_ = nullptr;  // OSMesa: one at a time
    explain_ = workshop_.make_explainer(scene_, settings_);
  }
  const double before_ms = thread_cpu_ms();
  JobResult answer{.lease = inquiry.lease};
  answer.data = encode_finding(explain_({asked.key, asked.cell, std::move(*parent), asked.object}));
  answer.findings.push_back({answer.data.size(), thread_cpu_ms() - before_ms});
  return answer;
}

JobResult Compute::Bench::answer(const Inquiry& inquiry, std::atomic<std::uint64_t>& progress) {
  if (inquiry.explain) return explain(inquiry);
  if (!audit_) audit_ = workshop_.make_auditor(scene_, settings_);
  JobResult answer{.lease = inquiry.lease};
  for (const AuditAsked& asked : inquiry.audits) {
    if (shared_.cancelled) break;
    const double before_ms = thread_cpu_ms();
    std::optional<VisibleSet> visible = set_of(inquiry.sets[asked.visible]);
    std::optional<VisibleSet> suspects = set_of(inquiry.sets[asked.suspects]);
    if (!visible || !suspects)
      return failed(inquiry.lease, FailureKind::kTransient, "a set does not fit the scene");
    const Bytes finding = encode_finding(audit_({asked.key, asked.cell, std::move(*visible),
                                                 std::move(*suspects), asked.seed, asked.rays}));
    answer.findings.push_back({finding.size(), thread_cpu_ms() - before_ms});
    answer.data.insert(answer.data.end(), finding.begin(), finding.end());
    ++progress;
  }
  if (answer.findings.empty()) return failed(inquiry.lease, FailureKind::kTransient, "cancelled");
  if (answer.data.size() > kMaxResultBytes)
    return failed(inquiry.lease, FailureKind::kDeterministic, "an answer over its size limit");
  return answer;
}

void Compute::Shared::run() {
  std::unique_ptr<Bench> bench;
  if (workshop.begin_thread) workshop.begin_thread();
  std::unique_lock lock(mutex);
  for (;;) {
    changed.wait(lock, [&] { return stop || job.has_value(); });
    if (stop) break;
    const Job current = std::move(*job);
    job.reset();
    const std::shared_ptr<const Scene> use_scene = scene;
    const EvaluatorSettings use_settings = settings;
    const bool fresh = std::exchange(scene_changed, false);
    lock.unlock();
    JobResult answer;
    try {
      if (fresh || bench == nullptr) {
        bench.reset();  // the old one goes before the new one comes
        bench = std::make_unique<Bench>(*this, use_scene, use_settings);
      }
      answer = bench->work(current, progress);
    } catch (const std::bad_alloc&) {
      bench.reset();  // in the middle of something: not to be used again
      answer = failed(current.lease(), FailureKind::kResource, "out of memory");
    } catch (const std::exception& error) {
      bench.reset();
      answer = failed(current.lease(), FailureKind::kDeterministic, error.what());
    }
    lock.lock();
    result = std::move(answer);
    // Not under the lock: whom it wakes takes this thread's place, where this one has only the time
    // that nobody else wants, and would wait for the lock as long as anybody else wants some.
    lock.unlock();
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = write(event, &one, sizeof one);
    lock.lock();
  }
  stopped = true;
  changed.notify_all();
}

Compute::Compute(Workshop workshop) : shared_(std::make_shared<Shared>()) {
  PVS_CHECK(shared_->event >= 0);
  shared_->workshop = std::move(workshop);
  thread_ = std::thread([shared = shared_] { shared->run(); });
}

Compute::~Compute() {
  shared_->cancelled = true;
  std::unique_lock lock(shared_->mutex);
  shared_->stop = true;
  shared_->changed.notify_all();
  const bool ended =
      shared_->changed.wait_for(lock, std::chrono::seconds(1), [&] { return shared_->stopped; });
  lock.unlock();
  if (ended)
    thread_.join();
  else
    thread_.detach();
}

void Compute::use(std::shared_ptr<const Scene> scene, const EvaluatorSettings& settings) {
  PVS_CHECK(idle());
  const std::lock_guard lock(shared_->mutex);
  shared_->scene = std::move(scene);
  shared_->settings = settings;
  shared_->scene_changed = true;
}

void Compute::start(Job job) {
  PVS_CHECK(idle());
  running_ = true;
  shared_->progress = 1;
  shared_->cancelled = false;
  const std::lock_guard lock(shared_->mutex);
  PVS_CHECK(shared_->scene != nullptr);
  shared_->job = std::move(job);
  shared_->changed.notify_all();
}

std::uint64_t Compute::progress() const { return shared_->progress; }
void Compute::cancel() { shared_->cancelled = true; }
int Compute::ready_fd() const { return shared_->event; }

std::optional<JobResult> Compute::take_result() {
  const std::lock_guard lock(shared_->mutex);
  std::uint64_t count = 0;
  [[maybe_unused]] const ssize_t bytes = read(shared_->event, &count, sizeof count);
  std::optional<JobResult> result = std::exchange(shared_->result, std::nullopt);
  if (result) running_ = false;
  return result;
}

}  // namespace pvsfarm

#include "worker/service/compute.hpp"

#include <sys/eventfd.h>
#include <time.h>
#include <unistd.h>

#include <exception>
#include <new>

#include "common/base/check.hpp"

namespace pvsfarm {

struct Compute::Shared {
  MakeEvaluator make_evaluator;
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
  JobResult evaluate(const Task& task, const VisibleSet& everything, const EvaluateCell& evaluate);
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

VisibleSet occludees_of(const Scene& scene) {
  VisibleSet set = VisibleSet::all(scene.object_count());
  for (std::uint32_t i = 0; i < scene.object_count(); ++i)
    if (!scene.object(ObjectId{i}).occludee) set.remove(ObjectId{i});
  return set;
}

JobResult failed(const Task& task, FailureKind kind, std::string text) {
  JobResult result{.lease = task.lease};
  result.failure = TaskFailed{task.lease, kind, std::move(text)};
  return result;
}

}  // namespace

JobResult Compute::Shared::evaluate(const Task& task, const VisibleSet& everything,
                                    const EvaluateCell& evaluate_cell) {
  std::vector<VisibleSet> parents;
  for (const ParentSet& parent : task.parents) {
    if (parent.all) {
      parents.push_back(everything);
      continue;
    }
    Result<VisibleSet> set = decode_visible_set(parent.set, everything.universe());
    if (!set || set->universe() != everything.universe())
      return failed(task, FailureKind::kTransient, "a parent set does not fit the scene");
    parents.push_back(std::move(set).value());
  }
  JobResult answer{.lease = task.lease};
  for (const TaskCell& cell : task.cells) {
    if (cancelled) break;
    const double before_ms = thread_cpu_ms();
    const CellDelta delta = evaluate_cell(cell.key, cell.cell, parents[cell.parent]);
    DeltaHead head{
        .key = cell.key, .point_triangles = delta.point_triangles, .statistics = delta.statistics};
    head.statistics.cpu_ms = thread_cpu_ms() - before_ms;
    head.hidden_bytes = append(delta.hidden, answer.data);
    head.seen_bytes = append(delta.seen, answer.data);
    answer.deltas.push_back(head);
    ++progress;
  }
  if (answer.deltas.empty()) return failed(task, FailureKind::kTransient, "cancelled");
  if (answer.data.size() > kMaxResultBytes)
    return failed(task, FailureKind::kDeterministic, "a result over its size limit");
  return answer;
}

void Compute::Shared::run() {
  EvaluateCell evaluate_cell;
  VisibleSet everything;
  std::unique_lock lock(mutex);
  for (;;) {
    changed.wait(lock, [&] { return stop || job.has_value(); });
    if (stop) break;
    const Job current = std::move(*job);
    job.reset();
    const std::shared_ptr<const Scene> use_scene = scene;
    const bool fresh = std::exchange(scene_changed, false);
    lock.unlock();
    JobResult answer;
    try {
      if (fresh) {
        evaluate_cell = nullptr;  // the old one goes before the new one comes
        evaluate_cell = make_evaluator(use_scene, settings);
        everything = occludees_of(*use_scene);
      }
      answer = evaluate(current.task, everything, evaluate_cell);
    } catch (const std::bad_alloc&) {
      answer = failed(current.task, FailureKind::kResource, "out of memory");
    } catch (const std::exception& error) {
      answer = failed(current.task, FailureKind::kDeterministic, error.what());
    }
    lock.lock();
    result = std::move(answer);
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = write(event, &one, sizeof one);
  }
  stopped = true;
  changed.notify_all();
}

Compute::Compute(MakeEvaluator make_evaluator) : shared_(std::make_shared<Shared>()) {
  PVS_CHECK(shared_->event >= 0);
  shared_->make_evaluator = std::move(make_evaluator);
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

#include "tests/farm/instant_workers.hpp"

#include <algorithm>
#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "common/base/check.hpp"
#include "common/base/random.hpp"
#include "common/wire/socket.hpp"
#include "worker/service/messenger.hpp"

namespace pvsfarm {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

Hello hello_of(unsigned number) {
  Hello hello;
  hello.host = "instant";
  hello.pid = number;
  Random random(number);
  for (std::uint8_t& b : hello.worker) b = static_cast<std::uint8_t>(random.next());
  return hello;
}

// A function of the cell alone. Only a root hides anything: there every object is still visible.
JobResult answer(const Task& task, std::uint32_t objects) {
  JobResult result{.lease = task.lease};
  for (const TaskCell& cell : task.cells) {
    VisibleSet hidden = VisibleSet::none(objects);
    if (cell.key.is_root()) {
      Random random(cell.key.root);
      hidden = VisibleSet::all(objects);
      for (std::uint32_t i = 0; i < objects; ++i)
        if (random.below(3) != 0) hidden.remove(ObjectId{i});
    }
    const std::vector<std::byte> hides = encode(hidden), sees = encode(VisibleSet::none(objects));
    DeltaHead head{.key = cell.key, .hidden_bytes = hides.size(), .seen_bytes = sees.size()};
    head.statistics.cpu_ms = 5;
    result.deltas.push_back(head);
    for (const auto* bytes : {&hides, &sees})
      result.data.insert(result.data.end(), bytes->begin(), bytes->end());
  }
  return result;
}

}  // namespace

// Of all workers.
struct InstantWorkers::Shared {
  std::set<CellKey> answered, acknowledged;
  std::set<CellKey> acknowledged_before;  // by coordinators before this one
  std::uint64_t epoch = 0;                // of this one
};

struct InstantWorkers::Worker {
  std::unique_ptr<Dealer> dealer;
  std::unique_ptr<Messenger> messenger;
  std::optional<Job> job;
  Clock::time_point job_ends;
  std::map<LeaseId, std::vector<CellKey>> answered_leases;
  Shared* shared = nullptr;
  Clock::time_point start = Clock::now();

  Millis now() const { return std::chrono::duration_cast<Millis>(Clock::now() - start); }
};

InstantWorkers::InstantWorkers(std::string endpoint, const InstantWork& work)
    : endpoint_(std::move(endpoint)), work_(work), thread_([this] { run(); }) {}

InstantWorkers::~InstantWorkers() {
  stop_ = true;
  thread_.join();
}

WorkerFigures InstantWorkers::figures() const {
  const std::lock_guard lock(mutex_);
  return figures_;
}

void InstantWorkers::look_at(Worker& worker, const Decoded& decoded) {
  Shared& shared = *worker.shared;
  if (decoded.envelope.epoch != shared.epoch) {
    shared.epoch = decoded.envelope.epoch;
    shared.acknowledged_before = shared.acknowledged;
  }
  if (const auto* task = std::get_if<Task>(&decoded.message))
    for (const TaskCell& cell : task->cells)
      figures_.forgotten += shared.acknowledged_before.count(cell.key);
  const auto* ack = std::get_if<ResultAck>(&decoded.message);
  if (ack == nullptr) return;
  if (ack->outcome == ResultOutcome::kMismatch) ++figures_.mismatches;
  if (ack->outcome == ResultOutcome::kMerged || ack->outcome == ResultOutcome::kDuplicate)
    for (const CellKey& key : worker.answered_leases[ack->lease]) shared.acknowledged.insert(key);
  figures_.acknowledged = shared.acknowledged.size();
}

void InstantWorkers::step(Worker& worker) {
  const std::lock_guard lock(mutex_);
  while (const std::optional<Received> received = worker.dealer->receive()) {
    if (received->decoded) look_at(worker, *received->decoded);
    worker.messenger->receive(received->decoded, worker.now());
  }
  if (worker.messenger->take_scene_request()) worker.messenger->scene_ready();
  if (worker.job && Clock::now() >= worker.job_ends) {
    const Task& task = std::get<Task>(worker.job->work);
    for (const TaskCell& cell : task.cells) {
      worker.shared->answered.insert(cell.key);
      worker.answered_leases[task.lease].push_back(cell.key);
    }
    worker.messenger->finished(answer(task, work_.objects));
    worker.job.reset();
  }
  if (!worker.job && (worker.job = worker.messenger->take_job())) {
    const Task& task = std::get<Task>(worker.job->work);
    for (const TaskCell& cell : task.cells)
      figures_.cells_again += worker.shared->answered.count(cell.key);
    figures_.largest_task = std::max<std::uint64_t>(figures_.largest_task, task.cells.size());
    worker.job_ends =
        Clock::now() + std::chrono::microseconds(static_cast<std::int64_t>(
                           1000 * work_.cell_ms * static_cast<double>(task.cells.size())));
  }
  std::optional<Running> running;
  if (worker.job)
    running = Running{worker.job->lease(), static_cast<std::uint64_t>(worker.now().count())};
  worker.messenger->set_progress(running, 0);
  worker.messenger->tick(worker.now());
  while (const auto out = worker.messenger->next_outgoing())
    worker.dealer->send(out->envelope, out->message);
}

void InstantWorkers::run() {
  Shared shared;
  std::vector<Worker> workers(work_.workers);
  for (unsigned i = 0; i < work_.workers; ++i) {
    workers[i].messenger = std::make_unique<Messenger>(hello_of(i + 1), Millis(0));
    workers[i].shared = &shared;
  }
  connect_again_ = true;
  std::uint64_t epoch_before = 0;
  Clock::time_point next_try{};
  Clock::duration patience = 0ms;
  while (!stop_) {
    if (connect_again_.exchange(false)) {
      epoch_before = shared.epoch;
      next_try = {};
      patience = 50ms;
    }
    // Sooner than the sockets themselves, which wait half a second for one who listens.
    if (shared.epoch == epoch_before && Clock::now() >= next_try) {
      for (Worker& worker : workers) worker.dealer = Dealer::connect(endpoint_).value();
      next_try = Clock::now() + patience;
      patience *= 2;
    }
    for (Worker& worker : workers) {
      step(worker);
      worker.dealer->wait(1ms);
    }
  }
}

}  // namespace pvsfarm

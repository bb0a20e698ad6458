#include "tests/support/farm_simulation.hpp"

#include <algorithm>

namespace pvsfarm {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kSceneBytes = 10 * kChunkBytes + 77;  // more than may be asked for at once

VisibleSet hidden_from(const CellKey& key, const VisibleSet& parent) {
  VisibleSet hidden = parent;
  parent.for_each([&](ObjectId id) {
    if (!SimulatedWorld::hides(key, id)) hidden.remove(id);
  });
  return hidden;
}

// Of what is left, every other object is seen.
VisibleSet seen_from(const CellKey& key, const VisibleSet& parent, const VisibleSet& hidden) {
  VisibleSet seen = parent;
  seen.remove_all(hidden);
  const VisibleSet visible = seen;
  visible.for_each([&](ObjectId id) {
    if (Random(key.path * 31 + index_of(id)).below(2) != 0) seen.remove(id);
  });
  return seen;
}

// One viewpoint in some cells sees nearly all there is: they are not split.
std::uint64_t point_triangles_of(const CellKey& key, const VisibleSet& parent,
                                 const VisibleSet& hidden) {
  const std::uint64_t triangles = 10ull * (parent.count() - hidden.count());
  return Random(key.root * 13ull + key.path).below(10) == 0 ? triangles - triangles / 20
                                                            : triangles / 3;
}

// The first that is left, though it must not be hidden.
void hide_one_more(const VisibleSet& parent, CellDelta& delta) {
  VisibleSet left = parent;
  left.remove_all(delta.hidden);
  bool done = false;
  VisibleSet kept = parent;
  left.for_each([&](ObjectId id) {
    if (std::exchange(done, true)) return;
    kept.remove(id);
    delta.seen.remove(id);
  });
  // Sets can only shrink: what is hidden is what is not kept.
  kept.remove_all(delta.hidden);
  delta.hidden = parent;
  delta.hidden.remove_all(kept);
}

const Task& task_of(const SimulatedWorker& worker) { return std::get<Task>(worker.job->work); }

}  // namespace

bool SimulatedWorld::hides(const CellKey& key, ObjectId id) {
  return Random(key.root * 1'000'003ull + key.path * 7919 + index_of(id)).below(3) == 0;
}

Tree SimulatedWorld::tree() const {
  std::vector<Cell> cells;
  for (int i = 0; i < roots; ++i)
    cells.push_back(Cell::aligned({{i * 8., 0, 0}, {i * 8. + 8, 8, 8}}));
  return Tree({VisibleSet::all(objects), std::vector<std::uint32_t>(objects, 10)}, std::move(cells),
              {.budget_triangles = budget_triangles, .min_cell_m = 2});
}

CellDelta SimulatedWorld::evaluate(const CellKey& key, const VisibleSet& parent) const {
  CellDelta delta{.key = key, .hidden = hidden_from(key, parent), .seen = {}, .statistics = {}};
  delta.seen = seen_from(key, parent, delta.hidden);
  delta.point_triangles = point_triangles_of(key, parent, delta.hidden);
  delta.statistics.cpu_ms = 10;
  return delta;
}

std::map<CellKey, Digest> SimulatedWorld::golden() const {
  std::map<CellKey, Digest> rows;
  Tree all = tree();
  while (all.open_count() > 0)
    for (const CellKey& key : all.open_cells()) {
      const CellDelta delta = evaluate(key, all.decoded_parent(key));
      rows[key] = delta_digest(row_of(delta));
      EXPECT_TRUE(all.merge(delta).ok());
    }
  return rows;
}

ResultRow row_of(const CellDelta& delta) {
  return {delta.key, encode(delta.hidden), encode(delta.seen), delta.point_triangles,
          delta.statistics};
}

Result<std::optional<Digest>> ForgetfulLog::find(const CellKey& key) {
  const auto row = read(key).value();
  return row ? std::optional(delta_digest(*row)) : std::nullopt;
}

Result<std::optional<ResultRow>> ForgetfulLog::read(const CellKey& key) {
  for (const auto* rows : {&waiting, &committed})
    if (const auto at = rows->find(key); at != rows->end()) return std::optional(at->second);
  return std::optional<ResultRow>();
}

Status ForgetfulLog::replace(const ResultRow& row) {
  EXPECT_TRUE(committed.count(row.key) + waiting.count(row.key) > 0) << "nothing to replace";
  waiting[row.key] = row;
  return {};
}

Status ForgetfulLog::append(const ResultRow& row) {
  EXPECT_EQ(committed.count(row.key) + waiting.count(row.key), 0u) << "merged twice";
  // A child's row must never be durable before its parent's.
  if (!row.key.is_root()) {
    EXPECT_TRUE(committed.count(row.key.parent()) + waiting.count(row.key.parent()) > 0);
  }
  waiting[row.key] = row;
  return {};
}

std::map<CellKey, Digest> ForgetfulLog::digests() const {
  std::map<CellKey, Digest> rows;
  for (const auto& [key, row] : committed) rows[key] = delta_digest(row);
  return rows;
}

FarmSimulation::FarmSimulation(std::uint64_t seed, const SimulationSetup& setup)
    : random_(seed), setup_(setup), network_(random_, setup.faults.network) {
  if (setup_.faults.scene_fetched) scene_.resize(kSceneBytes, std::byte{7});
  scene_digest_ = digest_of(scene_);
  start_coordinator();
  workers_.resize(setup_.workers);
  for (Worker& worker : workers_) start_worker(worker);
  workers_[0].slow = setup_.faults.slow_worker > 1;
  workers_[0].lies = setup_.faults.first_lies;
}

bool FarmSimulation::run() {
  Millis next_fault = 1s;
  while (now_ < 24h) {
    now_ = std::max(now_ + 1ms, next_event(next_fault));
    deliver();
    for (Worker& worker : workers_) step(worker);
    EXPECT_TRUE(desk_->tick(now_).ok());
    if (setup_.faults.operated) operate();
    send_from_desk();
    if (desk_->done()) return true;
    drain_if_asked();
    if (now_ < next_fault) continue;
    next_fault = now_ + 1s;
    inject_faults();
  }
  return false;
}

Millis FarmSimulation::next_event(Millis next) const {
  next = std::min({next, network_.next_arrival(), desk_->next_wake(now_)});
  if (setup_.faults.operated) next = std::min(next, operates_at_);
  for (const Worker& worker : workers_) {
    next = std::min(next, worker.messenger->next_wake());
    if (worker.job && !worker.hangs) next = std::min(next, worker.job_ends);
  }
  return next;
}

void FarmSimulation::start_coordinator() {
  tree_ = std::make_unique<Tree>(setup_.world.tree());
  Merger merger(*tree_, log_);
  Estimate estimate;
  for (const auto& [key, row] : log_.committed) EXPECT_TRUE(merger.replay(row).ok());
  for (const CellKey& key : tree_->open_cells()) estimate.opened(key.depth());
  DeskSettings settings{.scene_digest = scene_digest_, .scene = scene_, .epoch = ++epoch_};
  settings.limits.board.attempts = 1'000;  // faults here are never the cell's
  settings.limits.board.conduct.crash_loop = 1'000;
  work_ = std::make_unique<BakeWork>(*tree_, log_, estimate);
  desk_ = std::make_unique<Desk>(settings, *work_, now_);
}

void FarmSimulation::start_worker(Worker& worker) {
  const bool slow = worker.slow, lies = worker.lies;
  const std::uint64_t connection = ++connections_;
  static_cast<SimulatedWorker&>(worker) = new_worker(
      connection, random_, now_, connection % 2 == 0 ? setup_.worker_minor : kProtocolMinorHighest);
  worker.slow = slow;
  worker.lies = lies;
  worker.scene.clear();
}

void FarmSimulation::send_from_desk() {
  for (Outgoing& out : desk_->take_outgoing())
    network_.post({.peer = out.peer,
                   .to_worker = true,
                   .type = out.message.index(),
                   .frames = encode(out.envelope, out.message)},
                  now_);
}

void FarmSimulation::deliver() {
  while (const auto packet = network_.next(now_)) {
    const Decoded message = decoded(*packet);
    if (!packet->to_worker) {
      EXPECT_TRUE(desk_->receive(packet->peer, message, now_).ok());
      send_from_desk();
      continue;
    }
    if (packet->peer == kOperator) hear_as_operator(message.message);
    for (Worker& worker : workers_)
      if (worker.peer == packet->peer) {
        worker.envelope = message.envelope;
        check_ack(message.message);
        worker.messenger->receive(message, now_);
        get_scene(worker);
      }
  }
}

// What was acknowledged is durable.
void FarmSimulation::check_ack(const Message& message) {
  const auto* ack = std::get_if<ResultAck>(&message);
  if (ack == nullptr || ack->outcome == ResultOutcome::kResend) return;
  if (!setup_.faults.first_lies) {
    EXPECT_NE(ack->outcome, ResultOutcome::kMismatch);
  }
  // A coordinator that died before the commit of a parent took its children along: they are made
  // again, and what is computed of them is of no use until then.
  if (ack->outcome == ResultOutcome::kStale) {
    EXPECT_GT(epoch_, 1u);
    return;
  }
  for (const CellKey& key : cells_of_[ack->lease]) EXPECT_EQ(log_.committed.count(key), 1u);
}

void FarmSimulation::get_scene(Worker& worker) {
  Messenger& messenger = *worker.messenger;
  if (messenger.take_scene_request()) {
    if (worker.scene.size() == scene_.size()) return messenger.scene_ready();
    messenger.fetch_scene(worker.scene.size());  // goes on where it was cut
  }
  if (const std::optional<BlobChunk> chunk = messenger.take_scene_chunk()) {
    EXPECT_EQ(chunk->offset, worker.scene.size());
    worker.scene.insert(worker.scene.end(), chunk->data.begin(), chunk->data.end());
    if (worker.scene.size() < scene_.size()) return;
    EXPECT_EQ(digest_of(worker.scene), scene_digest_);
    messenger.scene_ready();
  }
}

void FarmSimulation::begin_job(Worker& worker) {
  worker.job = worker.messenger->take_job();
  if (!worker.job) return;
  worker.cell_ends.clear();
  worker.cells = task_of(worker).cells.size();
  Millis end = now_;
  for (std::size_t i = 0; i < worker.cells; ++i) {
    const auto more = static_cast<std::uint64_t>(setup_.cell_more.count());
    const Millis cost = setup_.cell_least + Millis(random_.below(more));
    end += worker.slow ? Millis(static_cast<std::int64_t>(static_cast<double>(cost.count()) *
                                                          setup_.faults.slow_worker))
                       : cost;
    worker.cell_ends.push_back(end);
  }
  worker.job_ends = end;
}

void FarmSimulation::go_on(Worker& worker) {
  const auto first = worker.cell_ends.begin();
  const auto done =
      static_cast<std::size_t>(std::upper_bound(first, worker.cell_ends.end(), now_) - first);
  if (worker.hangs) {
    worker.messenger->set_progress(Running{worker.job->lease(), 1}, 0);
    return;
  }
  worker.messenger->set_progress(Running{worker.job->lease(), 1 + done}, 0);
  // What is asked to stop brings the cell that it is at, and those before.
  if (worker.messenger->cancelled(worker.job->lease()) && done < worker.cells) {
    worker.cells = done + 1;
    worker.job_ends = worker.cell_ends[done];
  }
  if (now_ >= worker.job_ends) finish(worker);
}

void FarmSimulation::step(Worker& worker) {
  Messenger& messenger = *worker.messenger;
  get_scene(worker);
  if (!worker.job) begin_job(worker);
  if (worker.job) go_on(worker);
  messenger.tick(now_);
  while (auto out = messenger.next_outgoing())
    network_.post({.peer = worker.peer,
                   .type = out->message.index(),
                   .frames = encode(out->envelope, out->message)},
                  now_);
  if (!messenger.leaving()) return;
  // Whoever looks after it starts another.
  if (worker.lies && messenger.leaving()->exit_code == kExitDoNotRetry) {
    EXPECT_NE(messenger.leaving()->text.find("is not what two others computed"), std::string::npos)
        << messenger.leaving()->text;
    liar_turned_out_ = true;
    worker.lies = false;
    return start_worker(worker);
  }
  EXPECT_NE(messenger.leaving()->exit_code, kExitDoNotRetry) << messenger.leaving()->text;
  if (messenger.leaving()->exit_code == kExitRetry) {
    EXPECT_TRUE(worker.hangs) << messenger.leaving()->text;
  }
  start_worker(worker);
}

void FarmSimulation::finish(Worker& worker) {
  const Task& task = task_of(worker);
  JobResult result{.lease = task.lease};
  if (happens(setup_.faults.task_fails)) {
    result.failure = TaskFailed{task.lease, FailureKind::kTransient, "no luck"};
    worker.job.reset();
    return worker.messenger->finished(std::move(result));
  }
  for (std::size_t i = 0; i < worker.cells; ++i) {
    const TaskCell& cell = task.cells[i];
    const ParentSet& from = task.parents[cell.parent];
    const std::uint32_t objects = setup_.world.objects;
    const VisibleSet parent =
        from.all ? VisibleSet::all(objects) : decode_visible_set(from.set, objects).value();
    CellDelta delta = setup_.world.evaluate(cell.key, parent);
    if (worker.lies) hide_one_more(parent, delta);
    ResultRow row = row_of(delta);
    const Millis began = i == 0 ? Millis(0) : worker.cell_ends[i - 1];
    if (i > 0) row.statistics.cpu_ms = static_cast<double>((worker.cell_ends[i] - began).count());
    if (cell.key == refuted_cell) row.statistics.contradictions = 2;
    result.deltas.push_back(
        {cell.key, row.hidden.size(), row.seen.size(), row.point_triangles, row.statistics});
    for (const Bytes& set : {row.hidden, row.seen})
      result.data.insert(result.data.end(), set.begin(), set.end());
    ++cells_evaluated_;
  }
  // A task that came twice is computed twice, and may have been stopped once: an acknowledgement
  // is of what is in both results.
  std::vector<CellKey> keys;
  for (const DeltaHead& delta : result.deltas) keys.push_back(delta.key);
  const auto [at, first] = cells_of_.try_emplace(task.lease, keys);
  if (!first && keys.size() < at->second.size()) at->second = keys;
  worker.job.reset();
  worker.messenger->finished(std::move(result));
}

void FarmSimulation::inject_faults() {
  const SimulatedFaults& faults = setup_.faults;
  if (happens(faults.coordinator_dies)) {
    restart_at_.reset();
    log_.waiting.clear();
    start_coordinator();
    for (Worker& worker : workers_) worker.peer = std::to_string(++connections_);
  }
  for (Worker& worker : workers_) {
    if (happens(faults.worker_dies)) {
      if (happens(0.5)) desk_->gone(worker.peer);  // else nobody tells
      start_worker(worker);
    }
    if (happens(faults.connection_breaks)) worker.peer = std::to_string(++connections_);
    if (happens(faults.worker_hangs)) worker.hangs = !worker.hangs;
    if (happens(faults.worker_drains)) worker.messenger->drain();
  }
}

}  // namespace pvsfarm

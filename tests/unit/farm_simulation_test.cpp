// The whole exchange under virtual time: the real desk, board, tree and merger, the real
// messengers and codec, a journal that forgets what it did not commit, and a network that loses,
// repeats, delays and reorders. Workers die and hang, connections break, the coordinator crashes.
// A failing seed replays: PVSFARM_SEED=N farm_simulation_test.
#include <gtest/gtest.h>

#include <map>

#include "common/base/random.hpp"
#include "coordinator/service/bake_work.hpp"
#include "coordinator/service/desk.hpp"
#include "tests/support/simulated_farm.hpp"

namespace pvsfarm {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t kObjects = 300;
constexpr std::uint64_t kBudget = 900;

// What the evaluator of this world hides: a fixed third of what is left at each depth.
VisibleSet hidden_from(const CellKey& key, const VisibleSet& parent) {
  VisibleSet hidden = parent;
  parent.for_each([&](ObjectId id) {
    Random hash(key.root * 1'000'003ull + key.path * 7919 + index_of(id));
    if (hash.below(3) != 0) hidden.remove(id);
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

CellDelta evaluate(const CellKey& key, const VisibleSet& parent) {
  CellDelta delta{.key = key, .hidden = hidden_from(key, parent), .seen = {}, .statistics = {}};
  delta.seen = seen_from(key, parent, delta.hidden);
  delta.point_triangles = point_triangles_of(key, parent, delta.hidden);
  delta.statistics.cpu_ms = 10;
  return delta;
}

ResultRow row_of(const CellDelta& delta) {
  return {delta.key, encode(delta.hidden), encode(delta.seen), delta.point_triangles,
          delta.statistics};
}

Tree new_tree() {
  std::vector<Cell> roots;
  for (int i = 0; i < 18; ++i) roots.push_back(Cell::aligned({{i * 8., 0, 0}, {i * 8. + 8, 8, 8}}));
  return Tree({VisibleSet::all(kObjects), std::vector<std::uint32_t>(kObjects, 10)},
              std::move(roots), {.budget_triangles = kBudget, .min_cell_m = 2});
}

using Rows = std::map<CellKey, Digest>;

Rows golden_rows() {
  Rows rows;
  Tree tree = new_tree();
  while (tree.open_count() > 0)
    for (const CellKey& key : tree.open_cells()) {
      const CellDelta delta = evaluate(key, tree.decoded_parent(key));
      rows[key] = delta_digest(row_of(delta));
      EXPECT_TRUE(tree.merge(delta).ok());
    }
  return rows;
}

struct ForgetfulLog : ResultLog {
  std::map<CellKey, ResultRow> committed, waiting;

  Result<std::optional<Digest>> find(const CellKey& key) override {
    for (const auto* rows : {&committed, &waiting})
      if (const auto at = rows->find(key); at != rows->end())
        return std::optional(delta_digest(at->second));
    return std::optional<Digest>();
  }
  Status append(const ResultRow& row) override {
    EXPECT_EQ(committed.count(row.key) + waiting.count(row.key), 0u) << "merged twice";
    // A child's row must never be durable before its parent's.
    if (!row.key.is_root()) {
      EXPECT_EQ(committed.count(row.key.parent()) + waiting.count(row.key.parent()), 1u);
    }
    waiting[row.key] = row;
    return {};
  }
  std::size_t uncommitted() const override { return waiting.size(); }
  Status commit() override {
    committed.merge(waiting);
    waiting.clear();
    return {};
  }
};

struct Faults {
  NetworkFaults network;
  double worker_dies = 0, worker_hangs = 0, connection_breaks = 0,
         coordinator_dies = 0;  // a second
};

const Task& task_of(const SimulatedWorker& worker) { return std::get<Task>(worker.job->work); }

class Simulation {
 public:
  Simulation(std::uint64_t seed, const Faults& faults)
      : random_(seed), faults_(faults), network_(random_, faults.network) {
    start_coordinator();
    workers_.resize(3);
    for (SimulatedWorker& worker : workers_) start_worker(worker);
  }

  // Until the bake is done, or a virtual day is over.
  bool run() {
    Millis next_fault = 1s;
    while (now_ < 24h) {
      now_ = std::max(now_ + 1ms, next_event(next_fault));
      ++steps;
      deliver();
      for (SimulatedWorker& worker : workers_) step(worker);
      EXPECT_TRUE(desk_->tick(now_).ok());
      send_from_desk();
      if (desk_->done()) return true;
      if (now_ < next_fault) continue;
      next_fault = now_ + 1s;
      inject_faults();
    }
    return false;
  }

  // Its evaluation says that a witness refutes two certificates.
  std::optional<CellKey> refuted_cell;
  std::vector<std::string> warnings() { return desk_->take_warnings(); }
  Millis now() const { return now_; }
  std::uint64_t steps = 0;
  const ForgetfulLog& log() const { return log_; }
  const BakeWork& work() const { return *work_; }

 private:
  Millis next_event(Millis next) const {
    next = std::min({next, network_.next_arrival(), desk_->next_wake(now_)});
    for (const SimulatedWorker& worker : workers_) {
      next = std::min(next, worker.messenger->next_wake());
      if (worker.job && !worker.hangs) next = std::min(next, worker.job_ends);
    }
    return next;
  }
  bool happens(double probability) { return random_.unit() < probability; }

  void start_coordinator() {
    tree_ = std::make_unique<Tree>(new_tree());
    Merger merger(*tree_, log_);
    Estimate estimate;
    for (const auto& [key, row] : log_.committed) EXPECT_TRUE(merger.replay(row).ok());
    for (const CellKey& key : tree_->open_cells()) estimate.opened(key.depth());
    DeskSettings settings{.scene_digest = scene_, .epoch = ++epoch_};
    settings.limits.board.attempts = 1'000;  // faults here are never the cell's
    work_ = std::make_unique<BakeWork>(*tree_, log_, estimate);
    desk_ = std::make_unique<Desk>(settings, *work_, now_);
  }

  void start_worker(SimulatedWorker& worker) { worker = new_worker(++connections_, random_, now_); }

  void send_from_desk() {
    for (Outgoing& out : desk_->take_outgoing())
      network_.post(
          {.peer = out.peer, .to_worker = true, .frames = encode(out.envelope, out.message)}, now_);
  }

  void deliver() {
    while (const auto packet = network_.next(now_)) {
      const Decoded message = decoded(*packet);
      if (!packet->to_worker) {
        EXPECT_TRUE(desk_->receive(packet->peer, message, now_).ok());
        send_from_desk();
        continue;
      }
      for (SimulatedWorker& worker : workers_)
        if (worker.peer == packet->peer) {
          check_ack(message.message);
          worker.messenger->receive(message, now_);
        }
    }
  }

  // What was acknowledged is durable.
  void check_ack(const Message& message) {
    const auto* ack = std::get_if<ResultAck>(&message);
    if (ack == nullptr || ack->outcome == ResultOutcome::kResend) return;
    EXPECT_NE(ack->outcome, ResultOutcome::kMismatch);
    // A coordinator that died before the commit of a parent took its children along: they are made
    // again, and what is computed of them is of no use until then.
    if (ack->outcome == ResultOutcome::kStale) {
      EXPECT_GT(epoch_, 1u);
      return;
    }
    for (const CellKey& key : cells_of_[ack->lease]) EXPECT_EQ(log_.committed.count(key), 1u);
  }

  void step(SimulatedWorker& worker) {
    Messenger& messenger = *worker.messenger;
    if (messenger.take_scene_request()) messenger.scene_ready();
    if (!worker.job) {
      worker.job = messenger.take_job();
      if (worker.job) {
        const auto cells = static_cast<std::uint64_t>(task_of(worker).cells.size());
        worker.job_ends = now_ + Millis(cells * (5 + random_.below(60)));
      }
    }
    if (worker.job) {
      tell_progress(worker, now_);
      if (!worker.hangs && now_ >= worker.job_ends) finish(worker);
    }
    messenger.tick(now_);
    while (auto out = messenger.next_outgoing())
      network_.post({.peer = worker.peer, .frames = encode(out->envelope, out->message)}, now_);
    if (!messenger.leaving()) return;
    // Whoever looks after it starts another.
    EXPECT_EQ(messenger.leaving()->exit_code, kExitRetry) << messenger.leaving()->text;
    EXPECT_TRUE(worker.hangs) << messenger.leaving()->text;
    start_worker(worker);
  }

  void finish(SimulatedWorker& worker) {
    const Task& task = task_of(worker);
    JobResult result{.lease = task.lease};
    for (const TaskCell& cell : task.cells) {
      const ParentSet& from = task.parents[cell.parent];
      const VisibleSet parent =
          from.all ? VisibleSet::all(kObjects) : decode_visible_set(from.set, kObjects).value();
      ResultRow row = row_of(evaluate(cell.key, parent));
      if (cell.key == refuted_cell) row.statistics.contradictions = 2;
      result.deltas.push_back(
          {cell.key, row.hidden.size(), row.seen.size(), row.point_triangles, row.statistics});
      for (const Bytes& set : {row.hidden, row.seen})
        result.data.insert(result.data.end(), set.begin(), set.end());
      cells_of_[task.lease].push_back(cell.key);
    }
    worker.job.reset();
    worker.messenger->finished(std::move(result));
  }

  void inject_faults() {
    if (happens(faults_.coordinator_dies)) {
      log_.waiting.clear();
      start_coordinator();
      for (SimulatedWorker& worker : workers_) worker.peer = std::to_string(++connections_);
    }
    for (SimulatedWorker& worker : workers_) {
      if (happens(faults_.worker_dies)) {
        if (happens(0.5)) desk_->gone(worker.peer);  // else nobody tells
        start_worker(worker);
      }
      if (happens(faults_.connection_breaks)) worker.peer = std::to_string(++connections_);
      if (happens(faults_.worker_hangs)) worker.hangs = !worker.hangs;
    }
  }

  Random random_;
  Faults faults_;
  SimulatedNetwork network_;
  Millis now_{0};
  Digest scene_ = DigestBuilder().add("scene").finish();
  ForgetfulLog log_;
  std::unique_ptr<Tree> tree_;
  std::unique_ptr<BakeWork> work_;
  std::unique_ptr<Desk> desk_;
  std::vector<SimulatedWorker> workers_;
  std::map<LeaseId, std::vector<CellKey>> cells_of_;
  std::uint64_t connections_ = 0, epoch_ = 0;
};

void expect_golden(const ForgetfulLog& log) {
  static const Rows golden = golden_rows();
  Rows rows;
  for (const auto& [key, row] : log.committed) rows[key] = delta_digest(row);
  EXPECT_EQ(rows.size(), golden.size());
  EXPECT_TRUE(rows == golden);
}

void run_with(const Faults& faults, std::uint64_t count) {
  run_seeds(count, [&](std::uint64_t seed) {
    Simulation simulation(seed, faults);
    ASSERT_TRUE(simulation.run()) << "not done within a virtual day";
    if (std::getenv("SIMV")) std::cerr << seed << " " << simulation.now().count() << " ms " << simulation.steps << " steps\n";
    expect_golden(simulation.log());
    EXPECT_TRUE(simulation.work().given_up().empty());
    EXPECT_EQ(simulation.work().disagreements(), 0u);
  });
}

}  // namespace

TEST(FarmSimulation, the_world_is_worth_simulating) {
  const Rows golden = golden_rows();
  EXPECT_GT(golden.size(), 100u);
  EXPECT_GT(golden.rbegin()->first.root, 10u);
  // Some cells end for what one viewpoint sees.
  Tree tree = new_tree();
  int stopped_by_points = 0;
  while (tree.open_count() > 0)
    for (const CellKey& key : tree.open_cells()) {
      const LeafReason reason = tree.merge(evaluate(key, tree.decoded_parent(key)))->reason;
      stopped_by_points += reason == LeafReason::kPointOverBudget;
    }
  EXPECT_GT(stopped_by_points, 3);
}

TEST(FarmSimulation, a_refuted_certificate_is_told_loudly_and_is_no_disagreement) {
  Simulation simulation(1, {});
  simulation.refuted_cell = CellKey{3, 1};
  ASSERT_TRUE(simulation.run());
  expect_golden(simulation.log());  // the objects stayed visible: the result stands
  EXPECT_EQ(simulation.work().contradictions(), 2u);
  EXPECT_EQ(simulation.work().disagreements(), 0u);
  const std::vector<std::string> warnings = simulation.warnings();
  ASSERT_EQ(warnings.size(), 1u) << warnings[0] << "\n" << warnings.back();
  EXPECT_NE(warnings[0].find("A WITNESS REFUTES A CERTIFICATE: cell 3/1, 2 objects"),
            std::string::npos)
      << warnings[0];
}

TEST(FarmSimulation, without_faults) { run_with({}, 20); }
TEST(FarmSimulation, messages_are_lost) { run_with({.network = {.lost = 0.05}}, 40); }
TEST(FarmSimulation, messages_are_repeated) { run_with({.network = {.repeated = 0.2}}, 40); }
TEST(FarmSimulation, messages_are_late_and_out_of_order) {
  run_with({.network = {.delayed = 0.05, .in_order = false}}, 40);
}
TEST(FarmSimulation, workers_die) { run_with({.worker_dies = 0.1}, 40); }
TEST(FarmSimulation, workers_hang) { run_with({.worker_hangs = 0.02}, 40); }
TEST(FarmSimulation, connections_break) { run_with({.connection_breaks = 0.1}, 40); }
TEST(FarmSimulation, the_coordinator_dies) { run_with({.coordinator_dies = 0.2}, 40); }
TEST(FarmSimulation, everything_at_once) {
  run_with({.network = {.lost = 0.01, .repeated = 0.05, .delayed = 0.01},
            .worker_dies = 0.02,
            .worker_hangs = 0.01,
            .connection_breaks = 0.02,
            .coordinator_dies = 0.02},
           100);
}

}  // namespace pvsfarm

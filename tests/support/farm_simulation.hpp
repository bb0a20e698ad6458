// A whole bake under virtual time: the real desk, board, tree and merger, the real messengers and
// codec, a journal that forgets what it did not commit, and a network that loses, repeats, delays
// and reorders. Workers die, hang and crawl, connections break, the coordinator crashes. An
// operator looks how it goes, pauses, goes on, drains and starts the same command again.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "coordinator/service/bake_work.hpp"
#include "coordinator/service/desk.hpp"
#include "tests/support/simulated_farm.hpp"

namespace pvsfarm {

// What is baked: roots side by side, and an evaluator that hides a fixed third of what is left.
struct SimulatedWorld {
  std::uint32_t objects = 300;
  std::uint64_t budget_triangles = 900;
  int roots = 18;

  Tree tree() const;
  CellDelta evaluate(const CellKey& key, const VisibleSet& parent) const;
  // Whether it may be hidden from that cell, whatever it starts from.
  static bool hides(const CellKey& key, ObjectId id);
  // The digests of all deltas, by one who does everything in order.
  std::map<CellKey, Digest> golden() const;
};

ResultRow row_of(const CellDelta& delta);

struct ForgetfulLog : ResultLog {
  std::map<CellKey, ResultRow> committed, waiting;

  Result<std::optional<Digest>> find(const CellKey& key) override;
  Result<std::optional<ResultRow>> read(const CellKey& key) override;
  Status append(const ResultRow& row) override;
  Status replace(const ResultRow& row) override;
  std::size_t uncommitted() const override { return waiting.size(); }
  Status commit() override {
    for (auto& [key, row] : waiting) committed[key] = std::move(row);
    waiting.clear();
    return {};
  }
  std::map<CellKey, Digest> digests() const;
};

struct SimulatedFaults {
  NetworkFaults network;
  // Probabilities, a second.
  double worker_dies = 0, worker_hangs = 0, connection_breaks = 0, coordinator_dies = 0,
         worker_drains = 0;
  double task_fails = 0;       // of tasks, for no lasting reason
  double slow_worker = 1;      // how many times slower the first one is
  bool first_lies = false;     // it hides an object too many in every cell, until it is turned out
  bool scene_fetched = false;  // by BLOB_GET, else it is at hand
  bool operated = false;
};

struct SimulationSetup {
  SimulatedWorld world;
  SimulatedFaults faults;
  std::size_t workers = 3;
  Millis cell_least{5}, cell_more{60};                 // what a cell takes: uniform between them
  std::uint32_t worker_minor = kProtocolMinorHighest;  // of every other worker
};

class FarmSimulation {
 public:
  FarmSimulation(std::uint64_t seed, const SimulationSetup& setup);

  // Until the bake is done, or a virtual day is over.
  bool run();

  // Its evaluation says that a witness refutes two certificates.
  std::optional<CellKey> refuted_cell;

  std::vector<std::string> warnings() { return desk_->take_warnings(); }
  const ForgetfulLog& log() const { return log_; }
  const BakeWork& work() const { return *work_; }
  const Desk& desk() const { return *desk_; }
  Millis now() const { return now_; }
  std::uint64_t cells_evaluated() const { return cells_evaluated_; }
  bool liar_turned_out() const { return liar_turned_out_; }
  // What the operator was told, and did.
  struct Operated {
    std::uint64_t reports = 0, pauses = 0, drains = 0, acks = 0;
  };
  const Operated& operated() const { return operated_; }

 private:
  struct Worker : SimulatedWorker {
    std::vector<Millis> cell_ends;  // of the job
    std::size_t cells = 0;          // that it will bring
    bool slow = false, lies = false;
    Envelope envelope;  // of the last message to it
    Bytes scene;
  };

  static constexpr const char* kOperator = "operator";  // its connection

  Millis next_event(Millis next) const;
  bool happens(double probability) { return random_.unit() < probability; }
  void start_coordinator();
  void start_worker(Worker& worker);
  void send_from_desk();
  void deliver();
  void check_ack(const Message& message);
  void get_scene(Worker& worker);
  void begin_job(Worker& worker);
  void go_on(Worker& worker);
  void step(Worker& worker);
  void finish(Worker& worker);
  void inject_faults();
  void operate();
  void say_as_operator(const Message& message);
  void hear_as_operator(const Message& message);
  void drain_if_asked();

  Random random_;
  SimulationSetup setup_;
  SimulatedNetwork network_;
  Millis now_{0};
  Bytes scene_;
  Digest scene_digest_;
  ForgetfulLog log_;
  std::unique_ptr<Tree> tree_;
  std::unique_ptr<BakeWork> work_;
  std::unique_ptr<Desk> desk_;
  std::vector<Worker> workers_;
  std::map<LeaseId, std::vector<CellKey>> cells_of_;
  std::uint64_t connections_ = 0, epoch_ = 0, cells_evaluated_ = 0;
  bool liar_turned_out_ = false, wants_pause_ = false;
  Operated operated_;
  Millis operates_at_{0};
  std::optional<Millis> restart_at_;
};

}  // namespace pvsfarm

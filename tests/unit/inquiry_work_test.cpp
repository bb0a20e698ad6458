// Questions to a farm under faults: every one is answered exactly once, or given up, or cut off by
// the deadline. The real desk, board, messengers and codec, under virtual time.
// A failing seed replays: PVSFARM_SEED=N inquiry_work_test.
#include <gtest/gtest.h>

#include <map>

#include "common/base/random.hpp"
#include "common/wire/finding_bytes.hpp"
#include "coordinator/service/desk.hpp"
#include "coordinator/service/inquiry_work.hpp"
#include "tests/support/fault_figures.hpp"
#include "tests/support/simulated_farm.hpp"

namespace pvsfarm {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t kObjects = 600'000;  // so that a set may be too large for a message
const CellKey kPoison{7, 1};                 // no worker survives this cell

Cell some_cell(double x) { return Cell::aligned({{x, 0, 0}, {x + 1, 1, 1}}); }

// A large set for a few cells, a small one for the others.
const VisibleSet& set_for(std::uint32_t root) {
  static const VisibleSet small = VisibleSet::none(kObjects);
  static const VisibleSet large = [] {
    VisibleSet set = VisibleSet::all(kObjects);
    for (std::uint32_t i = 0; i < kObjects; i += 2) set.remove(ObjectId{i});
    return set;
  }();
  return root % 40 == 10 ? large : small;
}

std::vector<Question> questions(std::uint32_t count) {
  std::vector<Question> list;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Cell cell = some_cell(i);
    if (i % 20 == 3)
      list.emplace_back(ExplainQuestion{{i, 1}, cell, set_for(i), ObjectId{i}});
    else if (i % 20 > 15)
      list.emplace_back(EvaluateQuestion{
          {i, 1}, cell, set_for(i), {.planes_per_face = 1 + static_cast<int>(i % 2)}});
    else
      list.emplace_back(AuditQuestion{{i, 1}, cell, set_for(i), set_for(i + 1), i, 100});
  }
  return list;
}

// What any worker answers: so that a mixed-up answer is seen.
AuditFinding answer_audit(const AuditAsked& asked, const ParentSet& visible) {
  AuditFinding finding{.key = asked.key, .rays = asked.seed * 3, .seen = {}, .violations = {}};
  finding.seen = decode_visible_set(visible.set, kObjects).value();
  finding.violations.push_back({ObjectId{asked.key.root}, {asked.cell.lo, asked.cell.hi}});
  return finding;
}

struct Faults {
  NetworkFaults network;
  double worker_dies = 0, worker_hangs = 0;  // a second
  int coordinator_deaths = 0;                // one a second, at first
  bool poison = false;                       // the worker of kPoison fails, and says so
};

std::size_t size_of(const Job& job) {
  if (const auto* task = std::get_if<Task>(&job.work)) return task->cells.size();
  return std::max<std::size_t>(1, std::get<Inquiry>(job.work).audits.size());
}

NetworkFaults in_order(NetworkFaults faults) {
  faults.in_order = true;
  return faults;
}

class Simulation {
 public:
  Simulation(std::uint64_t seed, const Faults& faults, std::uint32_t count,
             std::optional<Millis> deadline = std::nullopt)
      : random_(seed),
        faults_(faults),
        network_(random_, in_order(faults.network)),
        count_(count),
        epoch_(1000 * seed) {
    start_coordinator(deadline);
    workers_.resize(3);
    for (SimulatedWorker& worker : workers_) start_worker(worker);
  }

  bool run() {
    Millis next_fault = 1s;
    while (now_ < 24h && !testing::Test::HasFatalFailure()) {
      now_ += 5ms;
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

  const std::map<std::uint32_t, int>& answers() const { return answers_; }
  const QuestionList& list() const { return *list_; }
  const InquiryWork& work() const { return *work_; }
  Millis now() const { return now_; }
  std::uint64_t blobs() const { return blobs_; }

 private:
  bool happens(double probability) { return random_.unit() < probability; }

  void take(std::uint32_t number, const Finding& finding) {
    ++answers_[number];
    if (const auto* audit = std::get_if<AuditFinding>(&finding)) {
      EXPECT_EQ(audit->key, (CellKey{number, 1}));
      EXPECT_EQ(audit->rays, number * 3ull);
      EXPECT_EQ(audit->seen, set_for(number));
      ASSERT_EQ(audit->violations.size(), 1u);
      EXPECT_EQ(audit->violations[0].line.eye, some_cell(number).lo);
    } else if (const auto* delta = std::get_if<CellDelta>(&finding)) {
      EXPECT_EQ(delta->key, (CellKey{number, 1}));
      EXPECT_EQ(delta->hidden, set_for(number));
      EXPECT_EQ(delta->point_triangles, 1 + number % 2) << "evaluated with other settings";
    } else {
      EXPECT_EQ(std::get<ExplainFinding>(finding).lines_checked, number);
    }
  }

  // Nothing is kept of one that was killed: the same command asks everything again.
  void start_coordinator(std::optional<Millis> deadline = std::nullopt) {
    answers_.clear();
    desk_.reset();
    work_.reset();
    list_.emplace(questions(count_), [this](std::uint32_t number, Finding f) { take(number, f); });
    work_.emplace(*list_, kObjects);
    DeskSettings settings{.scene_digest = scene_, .epoch = ++epoch_};
    settings.deadline = deadline;
    if (!faults_.poison) settings.limits.board.attempts = 1'000;
    desk_ = std::make_unique<Desk>(settings, *work_, now_);
  }

  void start_worker(SimulatedWorker& worker) { worker = new_worker(++connections_, random_, now_); }

  void send_from_desk() {
    for (Outgoing& out : desk_->take_outgoing())
      network_.post({.peer = out.peer,
                     .to_worker = true,
                     .type = out.message.index(),
                     .frames = encode(out.envelope, out.message)},
                    now_);
  }

  void deliver() {
    while (const auto packet = network_.next(now_)) {
      const Decoded message = decoded(*packet);
      if (!packet->to_worker) {
        blobs_ += std::holds_alternative<BlobGet>(message.message);
        EXPECT_TRUE(desk_->receive(packet->peer, message, now_).ok());
        send_from_desk();
        continue;
      }
      for (SimulatedWorker& worker : workers_)
        if (worker.peer == packet->peer) worker.messenger->receive(message, now_);
    }
  }

  void step(SimulatedWorker& worker) {
    Messenger& messenger = *worker.messenger;
    if (messenger.take_scene_request()) messenger.scene_ready();
    if (!worker.job) {
      worker.job = messenger.take_job();
      if (worker.job) worker.job_ends = now_ + Millis(size_of(*worker.job) * random_.below(60) + 5);
    }
    if (worker.job) {
      tell_progress(worker, now_);
      const bool cancelled = messenger.cancelled(worker.job->lease());
      if (!worker.hangs && (cancelled || now_ >= worker.job_ends)) finish(worker, cancelled);
    }
    messenger.tick(now_);
    while (auto out = messenger.next_outgoing())
      network_.post({.peer = worker.peer,
                     .type = out->message.index(),
                     .frames = encode(out->envelope, out->message)},
                    now_);
    EXPECT_FALSE(messenger.leaving().has_value()) << messenger.leaving()->text;
    if (messenger.leaving()) start_worker(worker);
  }

  // A cancelled worker answers the first half.
  void finish(SimulatedWorker& worker, bool cancelled) {
    Job job = std::move(*worker.job);
    worker.job.reset();
    JobResult result{.lease = job.lease()};
    const std::size_t count = cancelled ? (size_of(job) + 1) / 2 : size_of(job);
    const auto add = [&](const Bytes& bytes) {
      result.data.insert(result.data.end(), bytes.begin(), bytes.end());
      return bytes.size();
    };
    if (const auto* task = std::get_if<Task>(&job.work)) {
      for (std::size_t i = 0; i < count; ++i) {
        const TaskCell& cell = task->cells[i];
        DeltaHead head{.key = cell.key};
        head.hidden_bytes = add(task->parents[cell.parent].set);
        head.seen_bytes = add(encode(VisibleSet::none(kObjects)));
        head.point_triangles = static_cast<std::uint64_t>(task->settings.value().planes_per_face);
        head.statistics.cpu_ms = 10;
        result.deltas.push_back(head);
      }
    } else if (const auto& inquiry = std::get<Inquiry>(job.work); inquiry.explain) {
      ExplainFinding finding{.lines_checked = inquiry.explain->key.root, .unblocked = {}};
      finding.visible = VisibleSet::none(kObjects);
      result.findings.push_back({add(encode_finding(finding)), 30});
    } else {
      for (std::size_t i = 0; i < count; ++i) {
        const AuditAsked& asked = inquiry.audits[i];
        if (faults_.poison && asked.key == kPoison)
          result.failure = TaskFailed{job.lease(), FailureKind::kDeterministic, "poison"};
        result.findings.push_back(
            {add(encode_finding(answer_audit(asked, inquiry.sets[asked.visible]))), 5});
      }
    }
    worker.messenger->finished(std::move(result));
  }

  void inject_faults() {
    if (faults_.coordinator_deaths-- > 0) {
      start_coordinator();
      for (SimulatedWorker& worker : workers_) worker.peer = std::to_string(++connections_);
    }
    for (SimulatedWorker& worker : workers_) {
      if (happens(faults_.worker_dies)) {
        if (happens(0.5)) desk_->gone(worker.peer);  // else nobody tells
        start_worker(worker);
      }
      if (happens(faults_.worker_hangs)) worker.hangs = !worker.hangs;
    }
  }

  Random random_;
  Faults faults_;
  SimulatedNetwork network_;
  Millis now_{0};
  Digest scene_ = DigestBuilder().add("scene").finish();
  std::map<std::uint32_t, int> answers_;
  std::uint32_t count_;
  std::uint64_t epoch_;
  std::optional<QuestionList> list_;
  std::optional<InquiryWork> work_;
  std::unique_ptr<Desk> desk_;
  std::vector<SimulatedWorker> workers_;
  std::uint64_t connections_ = 0, blobs_ = 0;
};

constexpr std::uint32_t kQuestions = 120;

void run_with(const Faults& faults, std::uint64_t count) {
  run_seeds(count, [&](std::uint64_t seed) {
    Simulation simulation(seed, faults, kQuestions);
    ASSERT_TRUE(simulation.run()) << "not done within a virtual day";
    EXPECT_EQ(simulation.answers().size(), kQuestions);
    for (const auto& [number, times] : simulation.answers()) EXPECT_EQ(times, 1) << number;
    EXPECT_TRUE(simulation.list().failures().empty());
    EXPECT_GE(simulation.blobs(), 9u);  // some sets were too large for a task
  });
}

}  // namespace

TEST(Inquiries, without_faults) { run_with({}, 3); }
TEST(Inquiries, messages_are_lost) { run_with({.network = {.lost = 0.05}}, 4); }
TEST(Inquiries, answers_are_repeated) { run_with({.network = {.repeated = 0.3}}, 4); }
TEST(Inquiries, messages_are_late_and_out_of_order) { run_with({.network = {.delayed = 0.05}}, 4); }
TEST(Inquiries, workers_die) { run_with({.worker_dies = 0.3}, 4); }
TEST(Inquiries, workers_hang) { run_with({.worker_hangs = 0.05}, 4); }

// What workers still have of the one before is no answer to the questions of the next.
TEST(Inquiries, the_coordinator_dies_and_the_same_command_asks_again) {
  run_with({.coordinator_deaths = 3}, 6);
  run_with({.network = {.lost = 0.05}, .coordinator_deaths = 5}, 4);
}

TEST(Inquiries, each_type_of_message_is_lost_repeated_and_late) {
  const std::uint64_t seeds = full_counts() ? 10 : 1;
  std::uint64_t runs = 0;
  for (const MessageFault& fault : inquiry_faults()) {
    SCOPED_TRACE(fault.what);
    run_with({.network = {.only = fault}, .worker_dies = 0.05, .coordinator_deaths = 1}, seeds);
    ++runs;
    if (HasFailure()) break;
  }
  record({.row = 13,
          .what = "violations in " + std::to_string(runs) + " kinds of fault of an inquiry, " +
                  std::to_string(seeds) + " seeds each",
          .asked = "0",
          .reached = HasFailure() ? "some" : "0",
          .held = !HasFailure()});
}

TEST(Inquiries, a_question_that_no_worker_can_answer_is_given_up_and_the_others_are_answered) {
  Simulation simulation(5, {.poison = true}, kQuestions);
  ASSERT_TRUE(simulation.run());
  EXPECT_EQ(simulation.list().failures(), std::vector<std::uint32_t>{kPoison.root});
  EXPECT_EQ(simulation.answers().size(), kQuestions - 1);
  EXPECT_EQ(simulation.work().given_up(), 1u);
}

TEST(Inquiries, at_the_deadline_what_is_answered_counts_and_the_rest_is_left) {
  Simulation simulation(6, {}, 3'000, 4s);
  ASSERT_TRUE(simulation.run());
  EXPECT_GT(simulation.answers().size(), 20u);
  EXPECT_LT(simulation.answers().size(), 3'000u);
  for (const auto& [number, times] : simulation.answers()) EXPECT_EQ(times, 1) << number;
  EXPECT_LT(simulation.now(), 5s);
}

TEST(Inquiries, a_hanging_worker_does_not_hold_up_the_deadline) {
  Simulation simulation(7, {.worker_hangs = 1}, 3'000, 4s);
  ASSERT_TRUE(simulation.run());
  EXPECT_LT(simulation.now(), 5s);
}

TEST(Inquiries, answers_that_do_not_fit_their_questions_are_refused) {
  std::map<std::uint32_t, int> answers;
  QuestionList list(questions(4), [&](std::uint32_t number, const Finding&) { ++answers[number]; });
  InquiryWork work(list, kObjects);
  ASSERT_EQ(work.take_open(0).size(), 4u);
  SetShelf shelf;
  ASSERT_TRUE(work.task({.lease = BoardLease{9}, .cells = {{0, 1}, {1, 1}}}, shelf).ok());
  const auto finding = [](std::uint32_t root) {
    return encode_finding(
        AuditFinding{.key = {root, 1}, .seen = VisibleSet::none(kObjects), .violations = {}});
  };
  const auto outcome = [&](LeaseId lease, const std::vector<Bytes>& findings) {
    FindingBegin head{.lease = lease, .findings = {}};
    WorkResult result{.worker = "worker", .lease = lease, .head = {}, .data = {}};
    for (const Bytes& bytes : findings) {
      head.findings.push_back({bytes.size(), 1});
      result.data.insert(result.data.end(), bytes.begin(), bytes.end());
    }
    result.head = head;
    WorkAnswer answer;
    const Status status = work.accept(result, answer);
    return status ? std::optional(answer.outcome) : std::nullopt;
  };
  EXPECT_EQ(outcome(LeaseId{8}, {finding(0)}), ResultOutcome::kStale);  // another coordinator's
  EXPECT_EQ(outcome(LeaseId{9}, {finding(1)}), std::nullopt);           // another cell
  EXPECT_EQ(outcome(LeaseId{9}, {Bytes(20, std::byte{0xff})}), std::nullopt);
  EXPECT_EQ(outcome(LeaseId{9}, {encode_finding(ExplainFinding{})}), std::nullopt);
  EXPECT_TRUE(answers.empty());
  EXPECT_EQ(outcome(LeaseId{9}, {finding(0)}), ResultOutcome::kMerged);
  EXPECT_EQ(outcome(LeaseId{9}, {finding(0), finding(1)}), ResultOutcome::kMerged);
  EXPECT_EQ(outcome(LeaseId{9}, {finding(0), finding(1)}), ResultOutcome::kDuplicate);
  EXPECT_EQ(outcome(LeaseId{9}, {finding(0), finding(1), finding(2)}), std::nullopt);
  EXPECT_EQ(answers, (std::map<std::uint32_t, int>{{0, 1}, {1, 1}}));
}

}  // namespace pvsfarm

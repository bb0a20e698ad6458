// The operator of a simulated farm: status, pause, resume, drain, and the same command again.
#include "tests/support/farm_simulation.hpp"

namespace pvsfarm {
namespace {

using namespace std::chrono_literals;

constexpr Millis kOperatesEvery{150};
constexpr std::uint64_t kMaxDrains = 4;

}  // namespace

void FarmSimulation::say_as_operator(const Message& message) {
  network_.post({.peer = kOperator, .type = message.index(), .frames = encode({}, message)}, now_);
}

// What came late or not at all shows in the next report.
void FarmSimulation::hear_as_operator(const Message& message) {
  if (std::holds_alternative<ControlAck>(message)) ++operated_.acks;
  const auto* report = std::get_if<StatusReport>(&message);
  if (report == nullptr) return;
  ++operated_.reports;
  EXPECT_TRUE(report->state == "running" || report->state == "paused" ||
              report->state == "draining")
      << report->state;
  if (happens(0.1)) wants_pause_ = !wants_pause_;
  if (wants_pause_ != (report->state == "paused") && report->state != "draining") {
    if (wants_pause_) ++operated_.pauses;
    say_as_operator(Control{wants_pause_ ? ControlKind::kPause : ControlKind::kResume});
  }
  if (operated_.drains < kMaxDrains && happens(0.02)) say_as_operator(Control{ControlKind::kDrain});
}

// Looks, and asks a worker to drain now and then.
void FarmSimulation::operate() {
  if (now_ < operates_at_) return;
  operates_at_ = now_ + kOperatesEvery;
  say_as_operator(StatusGet{});
  Worker& worker = workers_[random_.below(workers_.size())];
  if (!happens(0.02) || worker.envelope.session == 0) return;
  network_.post({.peer = worker.peer,
                 .to_worker = true,
                 .type = Message(Drain{}).index(),
                 .frames = encode(worker.envelope, Drain{})},
                now_);
}

// As the service does it: what runs is finished, SHUTDOWN said, half a second waited; then the same
// command is given again.
void FarmSimulation::drain_if_asked() {
  if (restart_at_ && now_ >= *restart_at_) {
    restart_at_.reset();
    log_.waiting.clear();
    start_coordinator();
    for (Worker& worker : workers_) worker.peer = std::to_string(++connections_);
    return;
  }
  if (!desk_->drain_asked() || restart_at_) return;
  desk_->stop_leasing();
  if (!desk_->quiet()) return;
  ++operated_.drains;
  desk_->say_shutdown();
  send_from_desk();
  restart_at_ = now_ + 500ms;
}

}  // namespace pvsfarm

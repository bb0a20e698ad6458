#include "coordinator/service/farm_loop.hpp"

#include <algorithm>
#include <array>

namespace pvsfarm {
namespace {
using namespace std::chrono_literals;
constexpr int kMessagesATurn = 256;  // then deadlines are looked at again
constexpr Millis kProgressEvery{200};
constexpr Millis kFlushLimit{2'000};  // for what is on its way when asked to stop
}  // namespace

Status FarmLoop::receive_some() {
  more_waiting_ = true;
  for (int i = 0; i < kMessagesATurn; ++i) {
    const std::optional<Received> received = router_.receive();
    if (!received) {
      more_waiting_ = false;
      return {};
    }
    if (Status status = desk_.receive(received->peer, received->decoded, now(), received->role);
        !status)
      return status;
  }
  return {};
}

// Before any result of its kernel can be committed.
Status FarmLoop::keep_kernel() {
  if (desk_.pinned_kernel() == kept_kernel_) return {};
  kept_kernel_ = desk_.pinned_kernel();
  return work_.keep_kernel(kept_kernel_);
}

void FarmLoop::send_all() {
  std::vector<Outgoing> batch = desk_.take_outgoing();
  while (!batch.empty()) {
    for (const Outgoing& out : batch) {
      const SendOutcome outcome = router_.send(out.peer, out.envelope, out.message);
      if (outcome == SendOutcome::kSent) continue;
      router_.forget(out.peer);
      desk_.gone(out.peer);
    }
    batch = desk_.take_outgoing();
  }
}

Status FarmLoop::look_after_workers() {
  if (workers_ == nullptr) return {};
  const auto worked = [&](std::uint32_t pid) {
    const StatusReport report = desk_.status(now());
    return std::any_of(
        report.workers.begin(), report.workers.end(),
        [&](const StatusReport::Worker& w) { return w.pid == pid && w.cells_done > 0; });
  };
  const auto ended = workers_->look_after(cells_done_, worked, Clock::now());
  if (!ended) return Error{ended.error().kind, ended.error().text + "; " + work_.when_stopped()};
  for (const LocalWorkers::Ended& worker : *ended) {
    if (observer_.warning)
      observer_.warning("worker " + std::to_string(worker.pid) + " ended: " + worker.how);
    desk_.worker_exited(worker.pid);
  }
  return {};
}

void FarmLoop::say_how_far() {
  for (LogEvent& news : desk_.take_news()) {
    // Workers of this machine come and go with the farm.
    const bool expected = workers_ != nullptr && news.event.rfind("worker_", 0) == 0;
    if (expected && news.level == LogLevel::kInfo) news.level = LogLevel::kDebug;
    if (observer_.event)
      observer_.event(news);
    else if (observer_.warning && news.level >= LogLevel::kWarning)
      observer_.warning(news.text);
  }
  if (now() < next_progress_) return;
  next_progress_ = now() + kProgressEvery;
  const StatusReport report = desk_.status(now());
  cells_done_ = report.cells_done;
  if (observer_.progress) observer_.progress(report);
}

bool FarmLoop::asked_to_stop() {
  const bool asked = signals_.interrupted() || desk_.drain_asked() || desk_.cancel_asked();
  if (!asked) return false;
  if (!stop_at_) {
    desk_.stop_leasing();
    // A drain waits for what runs, however long; an interrupt not for ever; a cancel not at all.
    const Millis limit = desk_.cancel_asked()     ? Millis(0)
                         : signals_.interrupted() ? kFlushLimit
                                                  : Millis(24h);
    stop_at_ = now() + limit;
    if (observer_.note) observer_.note("stopping: what runs may finish; again to quit at once");
  }
  if (desk_.cancel_asked()) stop_at_ = std::min(*stop_at_, now());
  if (signals_.interrupted()) stop_at_ = std::min(*stop_at_, now() + kFlushLimit);
  return desk_.quiet() || now() >= *stop_at_;
}

// A list that cannot be read changes nothing: who was let in stays, and nobody comes in by mistake.
void FarmLoop::reload_keys() {
  Result<AllowList> list = AllowList::read(allow_path_);
  if (!list) {
    if (observer_.warning) observer_.warning("the keys stay as they were: " + list.error().text);
    return;
  }
  const std::string count = std::to_string(list->size());
  const std::vector<PeerId> cut = router_.allow(std::move(list).value());
  for (const PeerId& peer : cut) {
    router_.forget(peer);
    desk_.gone(peer);
  }
  if (observer_.note)
    observer_.note(allow_path_ + " read again: " + count +
                   " keys; connections cut: " + std::to_string(cut.size()));
}

Status FarmLoop::run() {
  kept_kernel_ = desk_.pinned_kernel();
  while (!desk_.done()) {
    if (Status status = receive_some(); !status) return status;
    if (Status status = keep_kernel(); !status) return status;
    if (Status status = desk_.tick(now()); !status) return status;
    if (Status status = look_after_workers(); !status) return status;
    send_all();
    say_how_far();
    if (asked_to_stop()) {
      if (Status status = work_.commit(); !status) return status;
      return Error{ErrorKind::kInterrupted, "stopped; " + work_.when_stopped()};
    }
    if (more_waiting_ || desk_.done()) continue;
    const Millis wake = std::min(desk_.next_wake(now()), next_progress_);
    const std::array<int, 1> events{signals_.fd()};
    router_.wait(std::clamp(wake - now(), 1ms, Millis(kProgressEvery)), events);
    signals_.drain();
    if (signals_.take_hangup() && !allow_path_.empty()) reload_keys();
  }
  next_progress_ = Millis(0);
  say_how_far();
  return {};
}

}  // namespace pvsfarm

#include "worker/service/worker.hpp"

#include <signal.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <random>

#include "common/base/log.hpp"
#include "common/wire/socket.hpp"
#include "worker/service/scene_cache.hpp"

namespace pvsfarm {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr Millis kDrainLimit{25'000};
constexpr std::size_t kMaxInFlight = 8;        // messages in the socket's own queue
constexpr std::size_t kMaxUnacknowledged = 8;  // results, before the next task waits

volatile sig_atomic_t asked_to_leave = 0;
int signal_event = -1;

void on_signal(int) {
  asked_to_leave = 1;
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = write(signal_event, &one, sizeof one);
}

void catch_signals() {
  signal_event = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  struct sigaction action {};
  action.sa_handler = on_signal;
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
}

std::uint64_t resident_bytes() {
  std::uint64_t pages = 0, resident = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "re")) {
    if (std::fscanf(file, "%lu %lu", &pages, &resident) != 2) resident = 0;
    std::fclose(file);
  }
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

Hello make_hello(const WorkerOptions& options) {
  Hello hello;
  hello.build = options.build;
  hello.kernel = options.kernel;
  std::random_device device;
  for (std::uint8_t& b : hello.worker) b = static_cast<std::uint8_t>(device());
  std::array<char, 256> host{};
  if (gethostname(host.data(), host.size() - 1) == 0) hello.host = host.data();
  hello.pid = static_cast<std::uint32_t>(getpid());
  return hello;
}

class WorkerLoop {
 public:
  WorkerLoop(const WorkerOptions& options, std::unique_ptr<Dealer> dealer, Workshop workshop)
      : options_(options),
        dealer_(std::move(dealer)),
        cache_(options.cache_folder),
        compute_(std::move(workshop)),
        messenger_(make_hello(options), now()) {}

  int run();

 private:
  Millis now() const { return std::chrono::duration_cast<Millis>(Clock::now() - start_); }
  void receive_all();
  void prepare_scene();
  void drive_compute();
  void send_some();
  void check_handshake();
  void check_limits();
  void fail(int exit_code, const Error& error);

  const WorkerOptions& options_;
  Clock::time_point start_ = Clock::now();
  std::unique_ptr<Dealer> dealer_;
  SceneCache cache_;
  Compute compute_;
  Messenger messenger_;
  Digest scene_digest_;
  EvaluatorSettings settings_;
  ScenePointer waiting_scene_;  // until the task of the scene before it has ended
  bool scene_in_use_ = false;
  LeaseId running_lease_{};
  Millis last_busy_{0};
  std::optional<Millis> drain_since_;
  bool ever_welcomed_ = false, said_broken_ = false;
  std::optional<Leaving> failed_;
};

void WorkerLoop::fail(int exit_code, const Error& error) {
  if (!failed_) failed_ = Leaving{exit_code, error.text};
}

void WorkerLoop::receive_all() {
  while (!messenger_.leaving() && !failed_) {
    const std::optional<Received> received = dealer_->receive();
    if (!received) return;
    messenger_.receive(received->decoded, now());
    if (messenger_.welcomed()) ever_welcomed_ = true;
    prepare_scene();
  }
}

// Finds the scene that a WELCOME names, or has it fetched chunk by chunk.
void WorkerLoop::prepare_scene() {
  if (const std::optional<Welcome> wanted = messenger_.take_scene_request()) {
    if (scene_in_use_ && scene_digest_ == wanted->scene && settings_ == wanted->settings &&
        !waiting_scene_)
      return messenger_.scene_ready();
    scene_in_use_ = false;
    scene_digest_ = wanted->scene;
    settings_ = wanted->settings;
    // A path from the network is looked at only if it is from this machine, only read, and what
    // is there counts only by its digest.
    const bool here = is_local(options_.endpoint);
    waiting_scene_ = cache_.find(wanted->scene, here ? wanted->scene_path : "");
    if (!waiting_scene_) {
      const auto have = cache_.begin(wanted->scene, wanted->scene_bytes);
      if (!have) return fail(kExitRetry, have.error());
      log_info("fetching the scene, " + std::to_string(wanted->scene_bytes) + " bytes" +
               (*have > 0 ? ", of which " + std::to_string(*have) + " are here" : ""));
      messenger_.fetch_scene(*have);
    }
  }
  if (const std::optional<BlobChunk> chunk = messenger_.take_scene_chunk()) {
    const Result<bool> complete = cache_.add(*chunk);
    if (!complete) return fail(kExitRetry, complete.error());
    if (!*complete) return;
    waiting_scene_ = cache_.find(scene_digest_, "");
    if (!waiting_scene_) fail(kExitRetry, io_error("the fetched scene cannot be mapped"));
  }
}

void WorkerLoop::drive_compute() {
  if (const std::optional<JobResult> result = compute_.take_result()) {
    messenger_.finished(*result);
    last_busy_ = now();
  }
  if (compute_.idle() && waiting_scene_) {
    compute_.use(std::exchange(waiting_scene_, nullptr), settings_);
    scene_in_use_ = true;
    messenger_.scene_ready();
  }
  if (compute_.idle() && messenger_.unacknowledged() < kMaxUnacknowledged) {
    if (std::optional<Job> job = messenger_.take_job()) {
      running_lease_ = job->lease();
      compute_.start(std::move(*job));
    }
  }
  if (compute_.idle()) {
    messenger_.set_progress(std::nullopt, resident_bytes());
    return;
  }
  last_busy_ = now();
  if (messenger_.cancelled(running_lease_)) compute_.cancel();
  messenger_.set_progress(Running{running_lease_, compute_.progress()}, resident_bytes());
}

void WorkerLoop::send_some() {
  while (dealer_->queued() < kMaxInFlight) {
    const std::optional<Messenger::Outgoing> out = messenger_.next_outgoing();
    if (!out) return;
    dealer_->send(out->envelope, out->message);
  }
}

// A key that is not let in, or no keys where some are needed: waiting would not help.
void WorkerLoop::check_handshake() {
  const Dealer::Handshake handshake = dealer_->handshake();
  if (handshake == Dealer::Handshake::kRefused) {
    const std::string key =
        options_.security ? "this key, " + hex_of(options_.security->keys.public_key) : "no keys";
    return fail(kExitDoNotRetry,
                runtime_error(options_.endpoint + ": the coordinator does not let in " + key));
  }
  if (handshake == Dealer::Handshake::kOther && !ever_welcomed_)
    return fail(kExitDoNotRetry,
                runtime_error(options_.endpoint +
                              ": the coordinator uses keys and this worker none, or the other way "
                              "round; see --key and --server-key"));
  if (handshake == Dealer::Handshake::kBroken && options_.security && !said_broken_) {
    said_broken_ = true;
    log_warning(options_.endpoint + ": the coordinator hangs up; is --server-key its public key?");
  }
}

void WorkerLoop::check_limits() {
  if (asked_to_leave != 0 && !drain_since_) {
    drain_since_ = now();
    messenger_.drain();
  }
  if (drain_since_ && now() - *drain_since_ > kDrainLimit)
    fail(kExitRetry, runtime_error("did not finish its task within the drain limit"));
  const auto max_idle = Millis(static_cast<std::int64_t>(options_.max_idle_s * 1e3));
  if (max_idle.count() > 0 && !messenger_.busy() && now() - last_busy_ > max_idle) {
    if (!ever_welcomed_)
      return fail(kExitRetry, runtime_error(options_.endpoint + ": no coordinator answered"));
    if (!drain_since_) drain_since_ = now();
    messenger_.drain();  // says BYE
  }
}

int WorkerLoop::run() {
  while (!messenger_.leaving() && !failed_) {
    receive_all();
    drive_compute();
    check_handshake();
    check_limits();
    messenger_.tick(now());
    send_some();
    const Millis wait = std::clamp(messenger_.next_wake() - now(), 1ms, 500ms);
    const std::array<int, 2> events{compute_.ready_fd(), signal_event};
    if (!messenger_.leaving() && !failed_)
      dealer_->wait(wait, std::span(events).first(asked_to_leave != 0 ? 1 : 2));
  }
  send_some();
  dealer_->linger(1s);
  const Leaving& why = failed_ ? *failed_ : *messenger_.leaving();
  if (!why.text.empty()) log_error(why.text);
  return why.exit_code;
}

}  // namespace

int run_worker(const WorkerOptions& options, Workshop workshop) {
  catch_signals();
  Result<std::unique_ptr<Dealer>> dealer = Dealer::connect(options.endpoint, options.security);
  if (!dealer) {
    log_error(dealer.error().text);
    return kExitDoNotRetry;
  }
  return WorkerLoop(options, std::move(dealer).value(), std::move(workshop)).run();
}

}  // namespace pvsfarm

#include "coordinator/service/local_workers.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <thread>

namespace pvsfarm {
namespace {

using namespace std::chrono_literals;

constexpr unsigned kMaxDeathsWithoutWork = 16;
constexpr int kDoNotRetry = 42;        // the worker's own exit code
constexpr auto kRestartDelay = 200ms;  // doubled with each process that completed nothing
constexpr auto kLongestDelay = 2s;
constexpr auto kGrace = 2s;

std::string describe_end(int status) {
  if (WIFEXITED(status)) return "exit code " + std::to_string(WEXITSTATUS(status));
  return "killed by signal " + std::to_string(WTERMSIG(status));
}

std::chrono::milliseconds restart_delay(unsigned fruitless) {
  std::chrono::milliseconds delay = kRestartDelay;
  for (unsigned i = 1; i < fruitless && delay < kLongestDelay; ++i) delay *= 2;
  return std::min<std::chrono::milliseconds>(delay, kLongestDelay);
}

// Between fork and exec: only what is safe in a process of several threads.
[[noreturn]] void become_worker(const char* program, char* const* arguments, pid_t parent,
                                bool own_session) {
  // Ctrl-C is the coordinator's; it tells the workers itself.
  own_session ? static_cast<void>(setsid()) : static_cast<void>(setpgid(0, 0));
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // nobody is left to take its result
  if (getppid() != parent) _exit(kDoNotRetry);
  const int null = open("/dev/null", O_RDONLY);
  if (null >= 0) dup2(null, STDIN_FILENO);
  dup2(STDERR_FILENO, STDOUT_FILENO);  // stdout carries the coordinator's data alone
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  execv(program, arguments);
  _exit(127);
}

}  // namespace

LocalWorkers::LocalWorkers(LocalWorkerOptions options)
    : options_(std::move(options)), slots_(options_.count) {}

Status LocalWorkers::spawn(Slot& slot) {
  std::vector<char*> arguments{options_.program.data()};
  for (std::string& argument : options_.arguments) arguments.push_back(argument.data());
  arguments.push_back(nullptr);
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0)
    become_worker(options_.program.c_str(), arguments.data(), parent, options_.own_sessions);
  if (pid < 0) return runtime_error(std::string("cannot start a worker: ") + std::strerror(errno));
  slot.pid = pid;
  return {};
}

Status LocalWorkers::start() {
  if (access(options_.program.c_str(), X_OK) != 0)
    return runtime_error(options_.program + ": cannot run the worker: " + std::strerror(errno) +
                         "; it is installed beside pvsfarm");
  for (Slot& slot : slots_)
    if (Status status = spawn(slot); !status) return status;
  return {};
}

Result<std::vector<LocalWorkers::Ended>> LocalWorkers::look_after(
    std::uint64_t cells_done, const std::function<bool(std::uint32_t)>& worked,
    Clock::time_point now) {
  if (cells_done != cells_done_) deaths_without_work_ = 0;
  cells_done_ = cells_done;
  std::vector<Ended> ended;
  bool any_left = false;
  for (Slot& slot : slots_) {
    int status = 0;
    if (slot.pid != 0 && waitpid(slot.pid, &status, WNOHANG) == slot.pid) {
      last_end_ = describe_end(status);
      ended.push_back({static_cast<std::uint32_t>(slot.pid), last_end_});
      slot.fruitless = worked(ended.back().pid) ? 0 : slot.fruitless + 1;
      slot.pid = 0;
      slot.start_at = now + restart_delay(slot.fruitless);
      slot.retired = WIFEXITED(status) && WEXITSTATUS(status) == kDoNotRetry;
      ++deaths_without_work_;
    }
    if (deaths_without_work_ > kMaxDeathsWithoutWork) slot.retired = true;
    if (slot.pid == 0 && !slot.retired && now >= slot.start_at)
      if (Status spawned = spawn(slot); !spawned) return spawned.error();
    any_left = any_left || slot.pid != 0 || !slot.retired;
  }
  if (!any_left) return runtime_error("no worker is left, the last ended with " + last_end_);
  return ended;
}

std::size_t LocalWorkers::running() const {
  std::size_t count = 0;
  for (const Slot& slot : slots_) count += slot.pid != 0 ? 1 : 0;
  return count;
}

void LocalWorkers::kill_all() {
  for (Slot& slot : slots_) {
    if (slot.pid == 0) continue;
    kill(slot.pid, SIGKILL);
    waitpid(slot.pid, nullptr, 0);
    slot.pid = 0;
  }
}

LocalWorkers::~LocalWorkers() {
  const auto give_up_at = Clock::now() + kGrace;
  for (const Slot& slot : slots_)
    if (slot.pid != 0) kill(slot.pid, SIGTERM);
  for (Slot& slot : slots_) {
    while (slot.pid != 0 && waitpid(slot.pid, nullptr, WNOHANG) == 0) {
      if (Clock::now() >= give_up_at) {
        kill(slot.pid, SIGKILL);
        waitpid(slot.pid, nullptr, 0);
        break;
      }
      std::this_thread::sleep_for(2ms);
    }
  }
}

}  // namespace pvsfarm

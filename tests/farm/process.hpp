// A child process of a test: started, watched, killed. What it prints goes to files.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "common/base/file.hpp"

namespace pvsfarm {

using TestClock = std::chrono::steady_clock;

inline bool wait_until(double limit_s, const std::function<bool()>& condition) {
  const auto end = TestClock::now() + std::chrono::duration<double>(limit_s);
  while (!condition()) {
    if (TestClock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

class Process {
 public:
  // `log`: prefix of the files LOG.out and LOG.err.
  Process(const std::vector<std::string>& command, const std::string& log) : log_(log) {
    pid_ = fork();
    if (pid_ != 0) return;
    for (const auto& [fd, suffix] : {std::pair{1, ".out"}, std::pair{2, ".err"}})
      dup2(open((log + suffix).c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), fd);
    std::vector<char*> arguments;
    for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    execv(arguments[0], arguments.data());
    _exit(127);
  }
  ~Process() {
    if (running()) {
      send(SIGKILL);
      wait(10);
    }
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  int pid() const { return pid_; }
  void send(int signal) const { kill(pid_, signal); }
  bool running() {
    if (code_ < 0 && waitpid(pid_, &status_, WNOHANG) == pid_)
      code_ = WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
    return code_ < 0;
  }
  // The exit code, 128 + N for signal N; -1 if it still runs then.
  int wait(double limit_s = 100) {
    wait_until(limit_s, [&] { return !running(); });
    return code_;
  }
  std::string out() const { return read_file(log_ + ".out").value(); }
  std::string err() const { return read_file(log_ + ".err").value(); }

 private:
  std::string log_;
  pid_t pid_ = 0;
  int status_ = 0, code_ = -1;
};

}  // namespace pvsfarm

// Processor time, and child processes with theirs.
#pragma once

#include <sys/types.h>
#include <string>
#include <vector>

#include "common/base/result.hpp"

namespace pvsfarm::bench {

// Of this process, all threads. Wall time says little on a machine that others use too.
double process_cpu_ms();
double wall_ms();

// A child process with its output in `log_path`; killed if it is not waited for.
class Child {
 public:
  struct Exit {
    int code = -1;  // 128 + signal if killed
    double cpu_ms = 0;
  };

  static Result<Child> start(const std::vector<std::string>& command, const std::string& log_path);
  Child(Child&& other) noexcept : pid_(other.pid_) { other.pid_ = -1; }
  Child& operator=(Child&&) = delete;
  ~Child();

  Exit wait();  // once

 private:
  explicit Child(pid_t pid) : pid_(pid) {}
  pid_t pid_ = -1;
};

}  // namespace pvsfarm::bench

// Ctrl-C, SIGTERM and the end of children, as something a poll loop can wait for.
#pragma once

namespace pvsfarm {

// While it lives: the first SIGINT or SIGTERM is counted, a second ends the process at once with
// exit code 130; SIGCHLD only wakes; so does SIGHUP, if asked for. Requires: one at a time.
class SignalWatch {
 public:
  explicit SignalWatch(bool with_hangups = false);
  ~SignalWatch();  // the actions before it are back
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;

  bool interrupted() const;
  bool take_hangup();  // SIGHUP has come since the last call
  int fd() const;      // readable after a signal, until drained
  void drain();
};

}  // namespace pvsfarm

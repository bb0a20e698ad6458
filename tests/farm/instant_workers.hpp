// Workers without an evaluator: the real messengers and sockets, answers out of a hat, at once.
// They see a coordinator from outside: what it has acknowledged, and whether it asks for it again.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

namespace pvsfarm {

struct Decoded;

struct InstantWork {
  unsigned workers = 2;  // of one slot each
  std::uint32_t objects = 0;
  double cell_ms = 0;  // a cell takes
};

struct WorkerFigures {
  std::uint64_t acknowledged = 0;  // cells
  std::uint64_t forgotten = 0;     // cells asked for although a coordinator before had them
  std::uint64_t cells_again = 0;   // of those taken up, that had been answered before
  std::uint64_t largest_task = 0;  // cells
  std::uint64_t mismatches = 0;
};

class InstantWorkers {
 public:
  InstantWorkers(std::string endpoint, const InstantWork& work);
  ~InstantWorkers();  // they leave without a word

  // New connections, for a coordinator that was started anew; what was not acknowledged is kept.
  void connect_again() { connect_again_ = true; }
  WorkerFigures figures() const;

 private:
  struct Shared;
  struct Worker;
  void run();
  void step(Worker& worker);
  void look_at(Worker& worker, const Decoded& decoded);

  const std::string endpoint_;
  const InstantWork work_;
  mutable std::mutex mutex_;
  WorkerFigures figures_;
  std::atomic<bool> connect_again_ = false, stop_ = false;
  std::thread thread_;
};

}  // namespace pvsfarm

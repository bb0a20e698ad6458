// A proxy between workers and their coordinator that does what networks do at their worst: delays,
// narrows, stops, flips bits, cuts off in the middle of a message, resets.
// Threads: all members from any; the work is done by a thread of its own.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace pvsfarm {

enum class Way { kUp, kDown };  // up: from the worker to the coordinator

struct ProxyOptions {
  std::string listen = "127.0.0.1";
  int port = 0;  // 0: the system chooses
  std::string upstream = "127.0.0.1";
  int upstream_port = 0;
  double delay_ms = 0;     // one way, both ways
  double bytes_per_s = 0;  // each way; 0: as fast as it goes
  std::uint64_t seed = 1;
};

struct ProxyFigures {
  std::uint64_t connections = 0;
  std::uint64_t bytes_up = 0, bytes_down = 0;  // that went through, not what it holds
  std::uint64_t flips = 0, resets = 0, cuts = 0;
};

class FaultyProxy {
 public:
  // Listens, and connects, in the network namespace of the calling thread. Aborts if it cannot.
  explicit FaultyProxy(const ProxyOptions& options);
  ~FaultyProxy();
  FaultyProxy(const FaultyProxy&) = delete;
  FaultyProxy& operator=(const FaultyProxy&) = delete;

  int port() const;
  std::string endpoint() const;  // tcp://LISTEN:PORT

  // Every so many bytes, at random, one bit is another. 0: none.
  void flip_every(std::uint64_t bytes);
  void stop(Way way, bool stopped);  // nothing goes through, and nobody is told
  // Of the next upload of at least so many bytes at once, half goes through, then nothing more of
  // that connection, until it ends.
  void cut_next_upload(std::uint64_t at_least_bytes);
  void reset_all();  // connections end with RST
  ProxyFigures figures() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm

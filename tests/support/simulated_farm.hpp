// What simulations of a farm under virtual time share: a network that loses, repeats, delays and
// reorders, workers with the real messengers, and the running of seeds.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <queue>
#include <string>
#include <vector>

#include "common/base/random.hpp"
#include "common/wire/codec.hpp"
#include "worker/service/messenger.hpp"

namespace pvsfarm {

// What happens to half of the messages of one type.
struct MessageFault {
  std::string what;      // "RESULT_ACK lost"; "" for nothing
  std::size_t type = 0;  // Message::index()
  enum class Kind { kLost, kRepeated, kDelayed } kind = Kind::kLost;
  bool large = false;  // happens with large results only
};
// Every type of message that a bake can have, with every kind of fault. (A reply lost is the loss
// of its type.) Those about it come from an operator.
std::vector<MessageFault> message_faults();
// Those of an inquiry.
std::vector<MessageFault> inquiry_faults();

struct NetworkFaults {
  double lost = 0, repeated = 0, delayed = 0;  // of messages
  bool in_order = true;  // each connection, but for what is delayed, as TCP has it
  MessageFault only;
};

struct Packet {
  Millis time{};
  std::uint64_t order = 0;
  std::string peer;  // the worker's connection
  bool to_worker = false;
  std::size_t type = 0;  // Message::index()
  Frames frames;
  bool operator>(const Packet& other) const {
    return std::tie(time, order) > std::tie(other.time, other.order);
  }
};

class SimulatedNetwork {
 public:
  // Keeps a reference: the stream of the whole simulation.
  SimulatedNetwork(Random& random, const NetworkFaults& faults)
      : random_(random), faults_(faults) {}

  void post(Packet packet, Millis now);
  // The next packet that has arrived by `now`, if any.
  std::optional<Packet> next(Millis now);
  Millis next_arrival() const { return packets_.empty() ? Millis::max() : packets_.top().time; }

 private:
  Random& random_;
  NetworkFaults faults_;
  std::priority_queue<Packet, std::vector<Packet>, std::greater<>> packets_;
  std::map<std::string, Millis> last_arrival_;
  std::uint64_t order_ = 0;
};

struct SimulatedWorker {
  std::string peer;
  std::unique_ptr<Messenger> messenger;
  std::optional<Job> job;
  Millis job_ends{};
  bool hangs = false;
};

// A process of its own, on a connection of its own.
SimulatedWorker new_worker(std::uint64_t connection, Random& random, Millis now,
                           std::uint32_t minor_highest = kProtocolMinorHighest);
// The task's state, as the worker's own thread would tell it.
void tell_progress(SimulatedWorker& worker, Millis now);
Decoded decoded(const Packet& packet);

// Runs `simulate` with `count` seeds, or with that of PVSFARM_SEED alone, until one fails.
void run_seeds(std::uint64_t count, const std::function<void(std::uint64_t seed)>& simulate);

}  // namespace pvsfarm

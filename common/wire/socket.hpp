// The two ends of the farm's connections: a Router at the coordinator, a Dealer at each worker or
// command. The only include of ZeroMQ.
//
// send() never blocks and never loses a message silently while the peer lives: what the transport
// does not take waits in a bounded queue of our own. A message taken can still vanish with its
// peer, so leases and acknowledgements decide, never send().
// Threads: a socket belongs to the thread that made it. A socket must not cross fork().
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/base/result.hpp"
#include "common/wire/codec.hpp"

namespace pvsfarm {

// A connection, as the Router names it; a peer that reconnects has a new one.
using PeerId = std::string;

inline constexpr std::size_t kMaxQueuedMessages = 256;  // a peer, beside ZeroMQ's own queue

enum class SendOutcome {
  kSent,  // taken, now or as soon as the peer reads
  kGone,  // no such connection
  kFull,  // the peer has not read for kMaxQueuedMessages
};

struct Received {
  PeerId peer;              // "" at a Dealer
  Result<Decoded> decoded;  // an Error: the peer broke the framing and should be dropped
};

class Router {
 public:
  // "ipc:///path", "tcp://127.0.0.1:5555"; a port of * or 0 lets the system choose.
  // Errors: kIo (in use, not permitted), kCommandLine (not an endpoint).
  static Result<std::unique_ptr<Router>> bind(const std::string& endpoint);
  ~Router();

  const std::string& endpoint() const;  // as bound: with the chosen port
  SendOutcome send(const PeerId& peer, const Envelope& envelope, const Message& message);
  std::optional<Received> receive();  // does not wait
  // Until a message, a readable `fd` of `fds`, a signal or the time out; sends what is queued.
  void wait(std::chrono::milliseconds timeout, std::span<const int> fds = {});
  void forget(const PeerId& peer);  // drops what is queued for it

 private:
  struct State;
  explicit Router(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

class Dealer {
 public:
  // Connects in the background and reconnects for ever, 500 ms to 2 s apart.
  // Errors: kCommandLine (not an endpoint).
  static Result<std::unique_ptr<Dealer>> connect(const std::string& endpoint);
  ~Dealer();

  SendOutcome send(const Envelope& envelope, const Message& message);
  std::optional<Received> receive();  // does not wait
  void wait(std::chrono::milliseconds timeout, std::span<const int> fds = {});
  std::size_t queued() const;  // messages that the transport has not taken yet
  // Sends what is queued and gives the transport up to `timeout` to deliver it when closing.
  void linger(std::chrono::milliseconds timeout);

 private:
  struct State;
  explicit Dealer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm

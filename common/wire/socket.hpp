// The two ends of the farm's connections: a Router at the coordinator, a Dealer at each worker or
// command. The only include of ZeroMQ.
//
// send() never blocks and never loses a message silently while the peer lives: what the transport
// does not take waits in a bounded queue of our own. A message taken can still vanish with its
// peer, so leases and acknowledgements decide, never send().
// What a peer can make the Router hold is bounded: frames by their size, messages by their three
// frames (a message without end is cut while it comes in), connections that do not finish their
// handshake by number and time.
// Threads: a socket belongs to the thread that made it. A socket must not cross fork().
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.hpp"
#include "common/wire/codec.hpp"
#include "common/wire/keys.hpp"

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
  Role role = Role::kNone;  // at a Router: what the peer's key allows it, now
  Result<Decoded> decoded;  // an Error: the peer broke the framing and should be dropped
};

// Whether an endpoint's peers can only be of this machine: ipc://, or a loopback address. With a
// port or without.
bool is_local(const std::string& endpoint);

class Router {
 public:
  // "ipc:///path", "tcp://127.0.0.1:5555"; a port of * or 0 lets the system choose. With
  // `security` only peers whose key is on its list are let in, by CURVE; before anything else a
  // key that is on no list has tried in vain. Without it whoever reaches the endpoint is kLocal.
  // Errors: kIo (in use, not permitted), kCommandLine (not an endpoint), kUnsupported (not local,
  // and no security), kRuntime (the trial key was not refused).
  static Result<std::unique_ptr<Router>> bind(const std::string& endpoint,
                                              std::optional<ServerSecurity> security = {});
  ~Router();

  const std::string& endpoint() const;  // as bound: with the chosen port
  SendOutcome send(const PeerId& peer, const Envelope& envelope, const Message& message);
  std::optional<Received> receive();  // does not wait
  // Until a message, a readable `fd` of `fds`, a signal or the time out; sends what is queued.
  void wait(std::chrono::milliseconds timeout, std::span<const int> fds = {});
  void forget(const PeerId& peer);  // drops what is queued for it

  // From now on this list counts, for connections that stand already as well: those whose key has
  // no role any more are cut and returned. Requires: bound with security.
  std::vector<PeerId> allow(AllowList list);

 private:
  struct State;
  explicit Router(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

class Dealer {
 public:
  // Connects in the background and reconnects for ever: 500 ms to 4 s apart on this machine, beyond
  // it 500 ms to 17 s apart at a pace drawn for this dealer. With `security` only to the
  // coordinator that has the server's private key. Errors: kCommandLine (not an endpoint).
  static Result<std::unique_ptr<Dealer>> connect(
      const std::string& endpoint, const std::optional<ClientSecurity>& security = {});
  ~Dealer();

  SendOutcome send(const Envelope& envelope, const Message& message);
  std::optional<Received> receive();  // does not wait
  void wait(std::chrono::milliseconds timeout, std::span<const int> fds = {});
  std::size_t queued() const;  // messages that the transport has not taken yet
  // Why the other end does not let this one in, as far as can be told; for as long as it is so.
  enum class Handshake {
    kFine,     // or nobody there
    kRefused,  // it does not accept this key
    kOther,    // it uses keys and this end does not, or the other way round
    kBroken,   // it hung up, as one does that has not the key which this end expects
  };
  Handshake handshake();
  // Sends what is queued and gives the transport up to `timeout` to deliver it when closing.
  void linger(std::chrono::milliseconds timeout);

 private:
  struct State;
  explicit Dealer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm

#include "common/wire/trial.hpp"

#include <chrono>
#include <optional>

#include "common/wire/authenticator.hpp"
#include "common/wire/despite_signals.hpp"
#include "common/wire/handshake_watch.hpp"

namespace pvsfarm {
namespace {

constexpr std::chrono::milliseconds kTrialPatience{5'000};

bool refused(zmq::context_t& context, const std::string& endpoint,
             const std::optional<ClientSecurity>& security) {
  zmq::socket_t socket(context, zmq::socket_type::dealer);
  socket.set(zmq::sockopt::linger, 0);
  if (security) present_key(socket, *security);
  HandshakeWatch watch(context, socket);
  despite_signals([&] { socket.connect(endpoint); });
  using Clock = std::chrono::steady_clock;
  for (const auto end = Clock::now() + kTrialPatience; Clock::now() < end;) {
    const HandshakeWatch::Last last = watch.next(std::chrono::milliseconds(50));
    if (last == HandshakeWatch::Last::kSucceeded) return false;
    if (last != HandshakeWatch::Last::kNothing) return true;
  }
  return false;  // nothing learnt is not enough
}

// An address that means all of them cannot be connected to everywhere.
std::string reachable(const std::string& endpoint) {
  const std::size_t port = endpoint.rfind(':');
  for (const char* all : {"tcp://0.0.0.0", "tcp://*"})
    if (endpoint.substr(0, port) == all) return "tcp://127.0.0.1" + endpoint.substr(port);
  if (endpoint.substr(0, port) == "tcp://[::]") return "tcp://[::1]" + endpoint.substr(port);
  return endpoint;
}

}  // namespace

Status try_in_vain(const std::string& endpoint, const KeyBytes& server) {
  zmq::context_t context(1);
  const std::string there = reachable(endpoint);
  if (refused(context, there, ClientSecurity{make_key_pair(), server}) &&
      refused(context, there, std::nullopt))
    return {};
  return runtime_error(endpoint +
                       ": a key that is on no list was not refused, so nobody can be "
                       "kept out; this libzmq cannot be used for a farm");
}

Status try_in_vain(const TrialDoor& door) {
  const KeyPair keys = make_key_pair();
  zmq::context_t context(1);
  std::optional<Authenticator> authenticator;
  zmq::socket_t socket(context, zmq::socket_type::router);
  if (door.answers) authenticator.emplace(context, AllowList());
  require_keys(socket, keys, door.enforces);
  socket.bind("tcp://127.0.0.1:*");
  return try_in_vain(socket.get(zmq::sockopt::last_endpoint), keys.public_key);
}

}  // namespace pvsfarm

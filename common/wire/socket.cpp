#include "common/wire/socket.hpp"

#include <arpa/inet.h>

#include <deque>
#include <random>
#include <unordered_map>
#include <utility>
#include <zmq.hpp>

#include "common/wire/authenticator.hpp"
#include "common/wire/connection_guard.hpp"
#include "common/wire/despite_signals.hpp"
#include "common/wire/handshake_watch.hpp"
#include "common/wire/trial.hpp"

namespace pvsfarm {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kHighWaterMark = 64;   // messages a peer in ZeroMQ's queues, each at most 1 MiB
constexpr int kRouterHighWater = 8;  // those on their way to the reader of a Router
constexpr int kHandshakeMs = 10'000;
constexpr int kBacklog = 1024;  // connections that the kernel keeps until they are looked at

void set_options(zmq::socket_t& socket) {
  socket.set(zmq::sockopt::linger, 0);
  socket.set(zmq::sockopt::maxmsgsize, static_cast<std::int64_t>(kMaxBodyBytes));
  socket.set(zmq::sockopt::sndhwm, kHighWaterMark);
  socket.set(zmq::sockopt::rcvhwm, kHighWaterMark);
  // The kernel reaps dead connections, after 30 s; whether a worker works is told by its own
  // heartbeats. Not those of ZeroMQ: libzmq 4.3 aborts (stream_engine_base.cpp, !_io_error) when
  // one falls due while messages of a peer wait that has reset its connection.
  socket.set(zmq::sockopt::tcp_keepalive, 1);
  socket.set(zmq::sockopt::tcp_keepalive_idle, 10);
  socket.set(zmq::sockopt::tcp_keepalive_intvl, 5);
  socket.set(zmq::sockopt::tcp_keepalive_cnt, 4);
  socket.set(zmq::sockopt::tcp_maxrt, 30'000);  // with data on its way
  socket.set(zmq::sockopt::handshake_ivl, kHandshakeMs);
}

// False: not now. Throws zmq::error_t for anything else.
bool send_part(zmq::socket_t& socket, std::string_view bytes, bool more) {
  const auto flags = more ? zmq::send_flags::sndmore : zmq::send_flags::none;
  const auto send = [&] {
    return socket.send(zmq::buffer(bytes), flags | zmq::send_flags::dontwait);
  };
  return despite_signals(send).has_value();
}

// Header and body; only the first frame of a message can be refused.
void send_rest(zmq::socket_t& socket, const Frames& frames) {
  send_part(socket, frames.header, true);
  send_part(socket, frames.body, false);
}

std::span<const std::byte> bytes_of(const zmq::message_t& part) {
  return {static_cast<const std::byte*>(part.data()), part.size()};
}

// All frames of one message, of which no more than `expected` are kept; empty: nothing to read.
std::vector<zmq::message_t> receive_parts(zmq::socket_t& socket, std::size_t expected,
                                          std::size_t& count) {
  std::vector<zmq::message_t> parts;
  count = 0;
  for (bool more = true; more;) {
    zmq::message_t part;
    const auto receive = [&] { return socket.recv(part, zmq::recv_flags::dontwait); };
    if (!despite_signals(receive)) break;
    more = part.more();
    if (++count <= expected) parts.push_back(std::move(part));
  }
  return parts;
}

// The connection that a message came by, and the key that was let in there. libzmq forgets to tell
// them of the first frame after a poll: ask the last.
int connection_of(zmq::message_t& part) { return zmq_msg_get(part.handle(), ZMQ_SRCFD); }
std::string key_of(zmq::message_t& part) {
  const char* key = zmq_msg_gets(part.handle(), "User-Id");
  return key == nullptr ? "" : key;
}

Result<Decoded> decode_parts(const zmq::message_t* header, const zmq::message_t* body,
                             bool right_count) {
  if (!right_count) return invalid_input("message refused: not of three frames");
  return decode(bytes_of(*header), bytes_of(*body));
}

void poll(zmq::socket_t& socket, std::chrono::milliseconds timeout, std::span<const int> fds) {
  std::vector<zmq::pollitem_t> items{{socket.handle(), 0, ZMQ_POLLIN, 0}};
  for (const int fd : fds) items.push_back({nullptr, fd, ZMQ_POLLIN, 0});
  try {
    zmq::poll(items, timeout);
  } catch (const zmq::error_t& error) {
    if (error.num() != EINTR) throw;
  }
}

// The first wait between tries, and the longest. Hundreds of machines that lost the same
// coordinator must not knock at its successor's door all at once, so each has a pace of its own; of
// one machine there are few.
std::pair<int, int> reconnect_pace(const std::string& endpoint) {
  for (const char* near : {"ipc://", "tcp://127.", "tcp://localhost:", "tcp://[::1]:"})
    if (endpoint.rfind(near, 0) == 0) return {500, 2'000};
  std::random_device device;
  return {500 + static_cast<int>(device() % 8'000), 8'500};
}

Error endpoint_error(const std::string& endpoint, const zmq::error_t& error, const char* verb) {
  const bool malformed = error.num() == EINVAL || error.num() == EPROTONOSUPPORT ||
                         error.num() == ENODEV || error.num() == ENAMETOOLONG;
  return {malformed ? ErrorKind::kCommandLine : ErrorKind::kIo,
          endpoint + ": cannot " + verb + ": " + error.what() +
              (malformed ? "; give tcp://127.0.0.1:PORT or ipc:///PATH" : "")};
}

}  // namespace

bool is_local(const std::string& endpoint) {
  constexpr std::string_view kTcp = "tcp://";
  if (endpoint.rfind("ipc://", 0) == 0) return true;
  if (endpoint.rfind(kTcp, 0) != 0) return false;
  const std::string host = endpoint.substr(kTcp.size(), endpoint.rfind(':') - kTcp.size());
  if (host == "localhost" || host == "[::1]") return true;
  in_addr address{};  // 127.example.org is a name, and no such address
  return inet_pton(AF_INET, host.c_str(), &address) == 1 && (ntohl(address.s_addr) >> 24) == 127;
}

struct Router::State {
  // In the order in which the parts need each other: they end the other way round.
  zmq::context_t context{1};
  std::optional<Authenticator> authenticator;
  zmq::socket_t socket{context, zmq::socket_type::router};
  std::optional<ConnectionGuard> guard;
  std::string endpoint;
  std::uint64_t sequence = 0;
  std::unordered_map<PeerId, std::deque<Frames>> queues;

  SendOutcome try_send(const PeerId& peer, const Frames& frames) {
    try {
      if (!send_part(socket, peer, true)) return SendOutcome::kFull;
      send_rest(socket, frames);
      return SendOutcome::kSent;
    } catch (const zmq::error_t& error) {
      if (error.num() == EHOSTUNREACH) return SendOutcome::kGone;
      throw;
    }
  }

  void flush() {
    for (auto it = queues.begin(); it != queues.end();) {
      std::deque<Frames>& queue = it->second;
      SendOutcome outcome = SendOutcome::kSent;
      while (!queue.empty() && outcome == SendOutcome::kSent) {
        outcome = try_send(it->first, queue.front());
        if (outcome == SendOutcome::kSent) queue.pop_front();
      }
      it = queue.empty() || outcome == SendOutcome::kGone ? queues.erase(it) : std::next(it);
    }
  }
};

Router::Router(std::unique_ptr<State> state) : state_(std::move(state)) {}
Router::~Router() = default;
const std::string& Router::endpoint() const { return state_->endpoint; }
void Router::forget(const PeerId& peer) { state_->queues.erase(peer); }

Result<std::unique_ptr<Router>> Router::bind(const std::string& endpoint,
                                             std::optional<ServerSecurity> security) {
  if (!security && !is_local(endpoint))
    return Error{ErrorKind::kUnsupported,
                 endpoint + ": other machines reach this, so it needs keys"};
  try {
    auto state = std::make_unique<State>();
    set_options(state->socket);
    state->socket.set(zmq::sockopt::router_mandatory, true);
    state->socket.set(zmq::sockopt::rcvhwm, kRouterHighWater);
    state->socket.set(zmq::sockopt::backlog, kBacklog);
    if (security) {
      require_keys(state->socket, security->keys);
      state->authenticator.emplace(state->context, std::move(security->allow));
    }
    state->guard.emplace(state->context, state->socket);
    despite_signals([&] { state->socket.bind(endpoint); });
    state->endpoint = state->socket.get(zmq::sockopt::last_endpoint);
    if (security)
      if (Status kept_out = try_in_vain(state->endpoint, security->keys.public_key); !kept_out)
        return kept_out.error();
    return std::unique_ptr<Router>(new Router(std::move(state)));
  } catch (const zmq::error_t& error) {
    return endpoint_error(endpoint, error, "listen");
  }
}

std::vector<PeerId> Router::allow(AllowList list) {
  PVS_CHECK(state_->authenticator.has_value());
  state_->authenticator->replace(std::move(list));
  return state_->guard->cut_if(
      [&](const std::string& key) { return state_->authenticator->role_of(key) == Role::kNone; });
}

SendOutcome Router::send(const PeerId& peer, const Envelope& envelope, const Message& message) {
  Envelope stamped = envelope;
  stamped.sequence = ++state_->sequence;
  Frames frames = encode(stamped, message);
  const auto queued = state_->queues.find(peer);
  if (queued == state_->queues.end()) {
    const SendOutcome outcome = state_->try_send(peer, frames);
    if (outcome != SendOutcome::kFull) return outcome;
  } else if (queued->second.size() >= kMaxQueuedMessages) {
    return SendOutcome::kFull;
  }
  state_->queues[peer].push_back(std::move(frames));
  return SendOutcome::kSent;
}

std::optional<Received> Router::receive() {
  std::size_t count = 0;
  std::vector<zmq::message_t> parts = receive_parts(state_->socket, 3, count);
  if (count == 0) {
    state_->guard->emptied();
    return std::nullopt;
  }
  const int connection = connection_of(parts.back());
  const std::string key = state_->authenticator ? key_of(parts.back()) : "";
  const Role role = state_->authenticator ? state_->authenticator->role_of(key) : Role::kLocal;
  PeerId peer = parts[0].to_string();
  state_->guard->read(connection, peer, key);
  const bool right = count == 3;
  if (role == Role::kNone || !right) state_->guard->cut(connection);
  if (role == Role::kNone)
    return Received{std::move(peer), role, invalid_input("its key is not on the list")};
  return Received{std::move(peer), role,
                  decode_parts(right ? &parts[1] : nullptr, right ? &parts[2] : nullptr, right)};
}

void Router::wait(std::chrono::milliseconds timeout, std::span<const int> fds) {
  state_->flush();
  // ROUTER tells nobody when a full peer reads again: look soon.
  if (!state_->queues.empty()) timeout = std::min(timeout, std::chrono::milliseconds(5));
  poll(state_->socket, timeout, fds);
  state_->flush();
}

struct Dealer::State {
  zmq::context_t context{1};
  zmq::socket_t socket{context, zmq::socket_type::dealer};
  HandshakeWatch watch{context, socket};
  Handshake handshake = Handshake::kFine;
  std::uint64_t sequence = 0;
  std::deque<Frames> queue;

  bool try_send(const Frames& frames) {
    if (!send_part(socket, frames.header, true)) return false;
    send_part(socket, frames.body, false);
    return true;
  }

  void flush() {
    while (!queue.empty() && try_send(queue.front())) queue.pop_front();
  }
};

Dealer::Dealer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Dealer::~Dealer() = default;
std::size_t Dealer::queued() const { return state_->queue.size(); }

Result<std::unique_ptr<Dealer>> Dealer::connect(const std::string& endpoint,
                                                const std::optional<ClientSecurity>& security) {
  try {
    auto state = std::make_unique<State>();
    set_options(state->socket);
    state->socket.set(zmq::sockopt::immediate, true);
    const auto [first_ms, most_ms] = reconnect_pace(endpoint);
    state->socket.set(zmq::sockopt::reconnect_ivl, first_ms);
    state->socket.set(zmq::sockopt::reconnect_ivl_max, most_ms);
    if (security) present_key(state->socket, *security);
    despite_signals([&] { state->socket.connect(endpoint); });
    return std::unique_ptr<Dealer>(new Dealer(std::move(state)));
  } catch (const zmq::error_t& error) {
    return endpoint_error(endpoint, error, "connect");
  }
}

SendOutcome Dealer::send(const Envelope& envelope, const Message& message) {
  if (state_->queue.size() >= kMaxQueuedMessages) return SendOutcome::kFull;
  Envelope stamped = envelope;
  stamped.sequence = ++state_->sequence;
  state_->queue.push_back(encode(stamped, message));
  state_->flush();
  return SendOutcome::kSent;
}

std::optional<Received> Dealer::receive() {
  state_->flush();
  std::size_t count = 0;
  const std::vector<zmq::message_t> parts = receive_parts(state_->socket, 2, count);
  if (count == 0) return std::nullopt;
  const bool right = count == 2;
  return Received{"", Role::kNone,
                  decode_parts(right ? &parts[0] : nullptr, right ? &parts[1] : nullptr, right)};
}

void Dealer::wait(std::chrono::milliseconds timeout, std::span<const int> fds) {
  state_->flush();
  if (!state_->queue.empty()) timeout = std::min(timeout, std::chrono::milliseconds(20));
  poll(state_->socket, timeout, fds);
  state_->flush();
}

Dealer::Handshake Dealer::handshake() {
  using Last = HandshakeWatch::Last;
  for (Last last; (last = state_->watch.next({})) != Last::kNothing;) switch (last) {
      case Last::kRefused:
        state_->handshake = Handshake::kRefused;
        break;
      case Last::kOther:
        state_->handshake = Handshake::kOther;
        break;
      case Last::kBroken:
        state_->handshake = Handshake::kBroken;
        break;
      default:
        state_->handshake = Handshake::kFine;
    }
  return state_->handshake;
}

void Dealer::linger(std::chrono::milliseconds timeout) {
  const auto end = Clock::now() + timeout;
  while (!state_->queue.empty() && Clock::now() < end) wait(std::chrono::milliseconds(20));
  state_->socket.set(zmq::sockopt::linger, static_cast<int>(timeout.count()));
}

}  // namespace pvsfarm

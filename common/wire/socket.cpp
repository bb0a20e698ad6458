#include "common/wire/socket.hpp"

#include <deque>
#include <unordered_map>
#include <vector>
#include <zmq.hpp>

namespace pvsfarm {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kHighWaterMark = 64;  // messages a peer in ZeroMQ's queues, each at most 1 MiB

void set_options(zmq::socket_t& socket) {
  socket.set(zmq::sockopt::linger, 0);
  socket.set(zmq::sockopt::maxmsgsize, static_cast<std::int64_t>(kMaxBodyBytes));
  socket.set(zmq::sockopt::sndhwm, kHighWaterMark);
  socket.set(zmq::sockopt::rcvhwm, kHighWaterMark);
  // These only reap dead connections; whether a worker works is told by its own heartbeats.
  socket.set(zmq::sockopt::heartbeat_ivl, 5'000);
  socket.set(zmq::sockopt::heartbeat_timeout, 30'000);
}

// False: not now. Throws zmq::error_t for anything else.
bool send_part(zmq::socket_t& socket, std::string_view bytes, bool more) {
  const auto flags = more ? zmq::send_flags::sndmore : zmq::send_flags::none;
  return socket.send(zmq::buffer(bytes), flags | zmq::send_flags::dontwait).has_value();
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
    if (!socket.recv(part, zmq::recv_flags::dontwait)) break;
    more = part.more();
    if (++count <= expected) parts.push_back(std::move(part));
  }
  return parts;
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

Error endpoint_error(const std::string& endpoint, const zmq::error_t& error, const char* verb) {
  const bool malformed = error.num() == EINVAL || error.num() == EPROTONOSUPPORT ||
                         error.num() == ENODEV || error.num() == ENAMETOOLONG;
  return {malformed ? ErrorKind::kCommandLine : ErrorKind::kIo,
          endpoint + ": cannot " + verb + ": " + error.what() +
              (malformed ? "; give tcp://127.0.0.1:PORT or ipc:///PATH" : "")};
}

}  // namespace

struct Router::State {
  zmq::context_t context{1};
  zmq::socket_t socket{context, zmq::socket_type::router};
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

Result<std::unique_ptr<Router>> Router::bind(const std::string& endpoint) {
  try {
    auto state = std::make_unique<State>();
    set_options(state->socket);
    state->socket.set(zmq::sockopt::router_mandatory, true);
    state->socket.bind(endpoint);
    state->endpoint = state->socket.get(zmq::sockopt::last_endpoint);
    return std::unique_ptr<Router>(new Router(std::move(state)));
  } catch (const zmq::error_t& error) {
    return endpoint_error(endpoint, error, "listen");
  }
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
  const std::vector<zmq::message_t> parts = receive_parts(state_->socket, 3, count);
  if (count == 0) return std::nullopt;
  const bool right = count == 3;
  return Received{parts[0].to_string(),
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

Result<std::unique_ptr<Dealer>> Dealer::connect(const std::string& endpoint) {
  try {
    auto state = std::make_unique<State>();
    set_options(state->socket);
    state->socket.set(zmq::sockopt::immediate, true);
    state->socket.set(zmq::sockopt::reconnect_ivl, 500);
    state->socket.set(zmq::sockopt::reconnect_ivl_max, 2'000);
    state->socket.connect(endpoint);
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
  return Received{"",
                  decode_parts(right ? &parts[0] : nullptr, right ? &parts[1] : nullptr, right)};
}

void Dealer::wait(std::chrono::milliseconds timeout, std::span<const int> fds) {
  state_->flush();
  if (!state_->queue.empty()) timeout = std::min(timeout, std::chrono::milliseconds(20));
  poll(state_->socket, timeout, fds);
  state_->flush();
}

void Dealer::linger(std::chrono::milliseconds timeout) {
  const auto end = Clock::now() + timeout;
  while (!state_->queue.empty() && Clock::now() < end) wait(std::chrono::milliseconds(20));
  state_->socket.set(zmq::sockopt::linger, static_cast<int>(timeout.count()));
}

}  // namespace pvsfarm

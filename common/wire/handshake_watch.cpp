#include "common/wire/handshake_watch.hpp"

#include <atomic>
#include <cerrno>
#include <cstring>

#include "common/wire/despite_signals.hpp"

namespace pvsfarm {
namespace {

constexpr int kEvents = ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH |
                        ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL;

std::string next_name() {
  static std::atomic<unsigned> count{0};
  return "inproc://handshakes-" + std::to_string(++count);
}

}  // namespace

HandshakeWatch::HandshakeWatch(zmq::context_t& context, zmq::socket_t& socket)
    : watched_(socket), events_(context, zmq::socket_type::pair) {
  const std::string name = next_name();
  events_.set(zmq::sockopt::linger, 0);
  watch_events(socket, events_, name, kEvents);
}

HandshakeWatch::~HandshakeWatch() { zmq_socket_monitor(watched_.handle(), nullptr, 0); }

HandshakeWatch::Last HandshakeWatch::next(std::chrono::milliseconds timeout) {
  zmq::pollitem_t item{events_.handle(), 0, ZMQ_POLLIN, 0};
  try {
    zmq::poll(&item, 1, timeout);
  } catch (const zmq::error_t& error) {
    if (error.num() != EINTR) throw;
  }
  zmq::message_t event;
  if (!take_event(events_, event)) return Last::kNothing;
  std::uint16_t kind = 0;
  if (event.size() >= sizeof kind) std::memcpy(&kind, event.data(), sizeof kind);
  switch (kind) {
    case ZMQ_EVENT_HANDSHAKE_SUCCEEDED:
      return Last::kSucceeded;
    case ZMQ_EVENT_HANDSHAKE_FAILED_AUTH:
      return Last::kRefused;
    case ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL:
      return Last::kOther;
    case ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL:
      return Last::kBroken;
    default:
      return Last::kNothing;
  }
}

}  // namespace pvsfarm

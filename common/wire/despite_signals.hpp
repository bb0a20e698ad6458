// A signal may cut short a call to ZeroMQ, even one that does not wait. Nothing is done then.
#pragma once

#include <cerrno>
#include <string>
#include <zmq.hpp>

namespace pvsfarm {

// Does it until it is done. Throws zmq::error_t for anything but a signal.
template <typename Operation>
auto despite_signals(const Operation& operation) {
  while (true) {
    try {
      return operation();
    } catch (const zmq::error_t& error) {
      if (error.num() != EINTR) throw;
    }
  }
}

// What happens to the connections of `watched`, from now on, to be read from `events`, a PAIR.
inline void watch_events(zmq::socket_t& watched, zmq::socket_t& events, const std::string& name,
                         int kinds) {
  despite_signals([&] {
    if (zmq_socket_monitor(watched.handle(), name.c_str(), kinds) != 0) throw zmq::error_t();
  });
  despite_signals([&] { events.connect(name); });
}

// An event of a socket's monitor, of which the first frame is kept. False: none is there.
inline bool take_event(zmq::socket_t& events, zmq::message_t& event) {
  const auto take = [&](zmq::message_t& part) {
    return despite_signals([&] { return events.recv(part, zmq::recv_flags::dontwait); });
  };
  if (!take(event)) return false;
  zmq::message_t address;
  if (event.more()) (void)take(address);
  return true;
}

}  // namespace pvsfarm

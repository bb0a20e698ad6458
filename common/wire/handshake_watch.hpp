// What becomes of a connecting socket's handshakes. Only common/wire includes this.
#pragma once

#include <chrono>
#include <string>
#include <zmq.hpp>

namespace pvsfarm {

class HandshakeWatch {
 public:
  enum class Last { kNothing, kSucceeded, kRefused, kOther, kBroken };

  // Before `socket` connects; `context` and `socket` outlive it.
  HandshakeWatch(zmq::context_t& context, zmq::socket_t& socket);
  ~HandshakeWatch();
  HandshakeWatch(const HandshakeWatch&) = delete;
  HandshakeWatch& operator=(const HandshakeWatch&) = delete;

  // The next thing that happened, waiting for it so long.
  Last next(std::chrono::milliseconds timeout);

 private:
  zmq::socket_t& watched_;
  zmq::socket_t events_;
};

}  // namespace pvsfarm

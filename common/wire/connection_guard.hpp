// Bounds what a peer can make a bound socket hold. Only common/wire includes this.
//
// libzmq bounds a frame, and the number of whole messages a peer has waiting; it does not bound
// the frames of one message, which wait where no reader sees them until the last has come, nor the
// connections that begin a handshake and leave it there. So a thread of the guard's own compares
// what the kernel has received on each connection with what the reader has got of it.
// Threads: members may be called from any.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>
#include <zmq.hpp>

namespace pvsfarm {

struct GuardLimits {
  // Of one connection: received, not part of a message that the reader got, although the reader
  // has emptied the socket since. A whole message is a header and a body and little more; libzmq
  // keeps 64 bytes for a frame of nothing, which is 2 on the wire.
  std::uint64_t unfinished_bytes = (1u << 20) + (1u << 17);
  // The same, while the reader is busy elsewhere: libzmq stops at kRouterHighWater messages.
  std::uint64_t unread_bytes = 4u << 20;
  std::size_t silent = 512;  // connections that have not said anything yet
};

class ConnectionGuard {
 public:
  // Before `socket` is bound; `context` and `socket` outlive it.
  ConnectionGuard(zmq::context_t& context, zmq::socket_t& socket, GuardLimits limits = {});
  ~ConnectionGuard();
  ConnectionGuard(const ConnectionGuard&) = delete;
  ConnectionGuard& operator=(const ConnectionGuard&) = delete;

  // The reader has got a message of this connection; it has emptied the socket.
  void read(int fd, const std::string& peer, const std::string& key);
  void emptied();

  void cut(int fd);  // hangs up
  // Hangs up on all whose key is chosen, and returns those peers.
  template <class Chosen>
  std::vector<std::string> cut_if(const Chosen& chosen);
  std::uint64_t cut_count() const;  // by the guard itself, for its limits

 private:
  struct Connection {
    std::uint64_t cookie = 0;  // the kernel's name for this very socket: numbers are used again
    std::uint64_t order = 0;
    bool has_read = false;
    bool cut = false;           // and not taken apart yet
    std::uint64_t base = 0;     // bytes used when the last message of it was read
    std::uint64_t before = 0;   // bytes used when the reader emptied the socket the last time
    std::uint64_t emptied = 0;  // how often it had, then
    std::string peer, key;
  };

  Connection& at(int fd);
  void watch();
  bool take_event();  // false: no more
  void look_at_all();
  void look_at(int fd, Connection& connection);
  void limit_silent();
  void cut_for_limit(int fd, Connection& connection);
  void hang_up(int fd, const Connection& connection);

  GuardLimits limits_;
  zmq::context_t& context_;
  zmq::socket_t& watched_;
  zmq::socket_t events_;
  mutable std::mutex mutex_;
  std::map<int, Connection> connections_;
  // Whose messages the reader had before this thread heard of them.
  std::map<int, Connection> early_;
  std::uint64_t accepted_ = 0, emptied_ = 0, cut_count_ = 0;
  bool stop_ = false;
  std::thread thread_;
};

template <class Chosen>
std::vector<std::string> ConnectionGuard::cut_if(const Chosen& chosen) {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> peers;
  for (const auto& [fd, connection] : connections_)
    if (!connection.peer.empty() && chosen(connection.key)) {
      peers.push_back(connection.peer);
      hang_up(fd, connection);
    }
  return peers;
}

}  // namespace pvsfarm

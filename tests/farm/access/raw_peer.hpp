// A peer that speaks ZMTP 3 byte by byte, over a TCP connection of its own: says what no library
// would.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace pvsfarm {

class RawPeer {
 public:
  // `endpoint`: tcp://127.0.0.1:PORT
  explicit RawPeer(const std::string& endpoint) : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port =
        htons(static_cast<std::uint16_t>(std::stoi(endpoint.substr(endpoint.rfind(':') + 1))));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    // Whoever is hung up on while the other end has no room learns of it late.
    const timeval patience{2, 0};
    setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    connected_ = connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  }
  RawPeer(RawPeer&& other) noexcept
      : socket_(std::exchange(other.socket_, -1)), connected_(other.connected_) {}
  ~RawPeer() {
    if (socket_ >= 0) close(socket_);
  }

  bool connected() const { return connected_; }
  // False: the other end has hung up, or reads no more.
  bool send(const std::string& bytes) const {
    for (std::size_t done = 0; done < bytes.size();) {
      const ssize_t sent = ::send(socket_, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
      if (sent <= 0) return false;
      done += static_cast<std::size_t>(sent);
    }
    return true;
  }
  // Hangs up so that the other end gets an error, not an end.
  void reset() {
    const linger at_once{1, 0};
    setsockopt(socket_, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    close(std::exchange(socket_, -1));
  }
  // So many bytes of what the other end says; fewer if it hangs up before.
  std::string receive(std::size_t count) const {
    std::string bytes(count, '\0');
    const ssize_t got = recv(socket_, bytes.data(), count, MSG_WAITALL);
    bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    return bytes;
  }
  // The handshake without keys, as far as libzmq's turn in it.
  bool shake_hands() const {
    send(greeting("NULL"));
    if (receive(64).size() != 64) return false;
    send(ready());
    const std::string head = receive(2);
    return head.size() == 2 && !receive(static_cast<unsigned char>(head[1])).empty();
  }
  // What the other end says meanwhile is read and forgotten.
  bool hangs_up(int limit_s) const {
    char buffer[4096];
    pollfd item{socket_, POLLIN, 0};
    while (poll(&item, 1, limit_s * 1000) > 0)
      if (recv(socket_, buffer, sizeof buffer, 0) <= 0) return true;
    return false;
  }

  static std::string greeting(std::string mechanism) {
    mechanism.resize(20, '\0');
    return std::string("\xff\0\0\0\0\0\0\0\1\x7f\3\0", 12) + mechanism + std::string(32, '\0');
  }
  // Flags: 1 more follows, 2 the length has 8 bytes, 4 a command.
  static std::string frame(const std::string& body, int flags) {
    std::string head(1, static_cast<char>(flags | (body.size() > 255 ? 2 : 0)));
    if (body.size() > 255) {
      head += long_length(body.size());
    } else {
      head += static_cast<char>(body.size());
    }
    return head + body;
  }
  static std::string long_length(std::uint64_t length) {
    std::string bytes;
    for (int shift = 56; shift >= 0; shift -= 8) bytes += static_cast<char>(length >> shift);
    return bytes;
  }
  static std::string command(const std::string& name, const std::string& data) {
    return frame(static_cast<char>(name.size()) + name + data, 4);
  }
  static std::string ready() {
    return command("READY", std::string("\x0bSocket-Type\0\0\0\6DEALER", 22));
  }
  static std::string message(const std::vector<std::string>& parts) {
    std::string bytes;
    for (std::size_t i = 0; i < parts.size(); ++i)
      bytes += frame(parts[i], i + 1 < parts.size() ? 1 : 0);
    return bytes;
  }

 private:
  int socket_;
  bool connected_ = false;
};

}  // namespace pvsfarm

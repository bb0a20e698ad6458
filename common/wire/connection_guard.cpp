#include "common/wire/connection_guard.hpp"

#include <linux/sockios.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <optional>
#include <utility>

#include "common/wire/despite_signals.hpp"

namespace pvsfarm {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kEvents = ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_HANDSHAKE_SUCCEEDED |
                        ZMQ_EVENT_DISCONNECTED | ZMQ_EVENT_MONITOR_STOPPED;
constexpr std::chrono::milliseconds kInterval{10};
constexpr int kRestPerWork = 50;  // at most 2 % of a core, however many connections

std::optional<std::uint64_t> cookie_of(int fd) {
  std::uint64_t cookie = 0;
  socklen_t size = sizeof cookie;
  if (getsockopt(fd, SOL_SOCKET, SO_COOKIE, &cookie, &size) != 0) return std::nullopt;
  return cookie;
}

// Bytes of a TCP connection that were read from the kernel so far; none for other sockets.
std::optional<std::uint64_t> bytes_used(int fd) {
  tcp_info info{};
  socklen_t size = sizeof info;
  int waiting = 0;
  if (getsockopt(fd, IPPROTO_TCP, TCP_INFO, &info, &size) != 0 ||
      size < offsetof(tcp_info, tcpi_bytes_received) + sizeof info.tcpi_bytes_received)
    return std::nullopt;
  const std::uint64_t received = info.tcpi_bytes_received;
  if (ioctl(fd, SIOCINQ, &waiting) != 0) return std::nullopt;
  return received - std::min<std::uint64_t>(received, static_cast<std::uint64_t>(waiting));
}

std::string next_name() {
  static std::atomic<unsigned> count{0};
  return "inproc://connections-" + std::to_string(++count);
}

}  // namespace

ConnectionGuard::ConnectionGuard(zmq::context_t& context, zmq::socket_t& socket, GuardLimits limits)
    : limits_(limits),
      context_(context),
      watched_(socket),
      events_(context, zmq::socket_type::pair) {
  const std::string name = next_name();
  events_.set(zmq::sockopt::linger, 0);
  events_.set(zmq::sockopt::rcvhwm, 0);  // an event that waits would hold up all connections
  watch_events(socket, events_, name, kEvents);
  thread_ = std::thread([this] { watch(); });
}

ConnectionGuard::~ConnectionGuard() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  // The monitor's last word wakes the thread.
  zmq_socket_monitor(watched_.handle(), nullptr, 0);
  thread_.join();
}

void ConnectionGuard::read(int fd, const std::string& peer, const std::string& key) {
  const std::lock_guard lock(mutex_);
  Connection& connection = at(fd);
  connection.has_read = true;
  if (connection.peer != peer) {
    connection.peer = peer;
    connection.key = key;
  }
}

void ConnectionGuard::emptied() {
  const std::lock_guard lock(mutex_);
  ++emptied_;
}

std::uint64_t ConnectionGuard::cut_count() const {
  const std::lock_guard lock(mutex_);
  return cut_count_;
}

void ConnectionGuard::cut(int fd) {
  const std::lock_guard lock(mutex_);
  Connection& connection = at(fd);
  connection.cut = true;
  hang_up(fd, connection);
}

ConnectionGuard::Connection& ConnectionGuard::at(int fd) {
  const auto found = connections_.find(fd);
  return found != connections_.end() ? found->second : early_[fd];
}

// libzmq reads the end of the connection, and takes it apart itself.
void ConnectionGuard::hang_up(int fd, const Connection& connection) {
  if (connection.cookie != 0 && cookie_of(fd) == connection.cookie) shutdown(fd, SHUT_RDWR);
}

bool ConnectionGuard::take_event() {
  zmq::message_t event;
  if (!pvsfarm::take_event(events_, event)) return false;
  std::uint16_t kind = 0;
  std::int32_t value = 0;
  if (event.size() < sizeof kind + sizeof value) return true;
  std::memcpy(&kind, event.data(), sizeof kind);
  std::memcpy(&value, static_cast<const char*>(event.data()) + sizeof kind, sizeof value);
  if (kind == ZMQ_EVENT_ACCEPTED) {
    Connection connection = std::exchange(early_[value], {});
    early_.erase(value);
    connection.cookie = cookie_of(value).value_or(0);
    connection.order = ++accepted_;
    if (connection.cut) hang_up(value, connection);
    connections_[value] = std::move(connection);
  } else if (kind == ZMQ_EVENT_DISCONNECTED) {
    connections_.erase(value);
  }
  return true;
}

void ConnectionGuard::look_at(int fd, Connection& connection) {
  const std::optional<std::uint64_t> used = bytes_used(fd);
  if (!used) return;  // a local socket, which this does not see through
  if (connection.has_read) {
    connection.has_read = false;
    connection.base = connection.before = *used;
    connection.emptied = emptied_;
    return;
  }
  // What was used at the last look, and did not come out although the reader has emptied the
  // socket since, belongs to a message without an end.
  bool endless = *used - connection.base > limits_.unread_bytes;
  if (emptied_ != connection.emptied) {
    endless = endless || connection.before - connection.base > limits_.unfinished_bytes;
    connection.before = *used;
    connection.emptied = emptied_;
  }
  if (endless) cut_for_limit(fd, connection);
}

void ConnectionGuard::cut_for_limit(int fd, Connection& connection) {
  if (connection.cut) return;
  connection.cut = true;
  ++cut_count_;
  hang_up(fd, connection);
}

// The oldest go first: an honest peer's handshake takes milliseconds, and then it speaks.
void ConnectionGuard::limit_silent() {
  std::vector<std::pair<std::uint64_t, int>> begun;
  for (const auto& [fd, connection] : connections_)
    if (connection.peer.empty()) begun.emplace_back(connection.order, fd);
  if (begun.size() <= limits_.silent) return;
  std::sort(begun.begin(), begun.end());
  begun.resize(begun.size() - limits_.silent);
  for (const auto& [order, fd] : begun) cut_for_limit(fd, connections_.at(fd));
}

void ConnectionGuard::look_at_all() {
  for (auto& [fd, connection] : connections_) look_at(fd, connection);
  limit_silent();
}

void ConnectionGuard::watch() {
  using std::chrono::milliseconds;
  milliseconds rest{-1};  // for ever, while nobody is connected
  Clock::time_point next_look{};
  try {
    while (true) {
      zmq::pollitem_t item{events_.handle(), 0, ZMQ_POLLIN, 0};
      despite_signals([&] { return zmq::poll(&item, 1, rest); });
      const std::lock_guard lock(mutex_);
      if (stop_) break;
      while (take_event()) {
      }
      if (const auto start = Clock::now(); start >= next_look) {
        look_at_all();
        const auto work = kRestPerWork * (Clock::now() - start);
        next_look = start + std::max<Clock::duration>(kInterval, work);
      }
      const auto until = std::chrono::ceil<milliseconds>(next_look - Clock::now());
      rest = connections_.empty() ? milliseconds(-1) : std::max(milliseconds(0), until);
    }
  } catch (const zmq::error_t&) {
    // The context ends.
  }
  events_.close();
}

}  // namespace pvsfarm

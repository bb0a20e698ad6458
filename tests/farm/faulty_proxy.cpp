#include "tests/farm/faulty_proxy.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sched.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <list>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/check.hpp"
#include "common/base/random.hpp"

namespace pvsfarm {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::size_t kRead = 64 * 1024;
// What a pipe may hold: a link with its delay, not a warehouse.
constexpr std::size_t kMaxHeld = 512 * 1024;

int open_socket() { return socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0); }

sockaddr_in address_of(const std::string& host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  PVS_CHECK_EQ(inet_pton(AF_INET, host.c_str(), &address.sin_addr), 1);
  return address;
}

void at_once(int fd) {
  const int one = 1;
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
}

// One way of a connection.
struct Pipe {
  struct Piece {
    Clock::time_point due;
    std::vector<char> bytes;
    std::size_t sent = 0;
  };
  std::deque<Piece> held;
  std::size_t bytes = 0;
  bool ended = false;        // its source says no more
  bool cut = false;          // swallows
  Clock::time_point free{};  // when the narrow place takes the next
};

struct Connection {
  int worker = -1, coordinator = -1;
  bool dead = false;
  Pipe up, down;
};

}  // namespace

struct FaultyProxy::State {
  ProxyOptions options;
  int listener = -1, port = 0, wake = -1;
  std::list<Connection> connections;
  Random random{1};
  std::uint64_t until_flip = 0;
  std::thread thread;

  mutable std::mutex mutex;  // guards what follows
  ProxyFigures figures;
  std::uint64_t flip_every = 0, cut_at_least = 0;
  bool stopped[2] = {false, false};
  bool reset = false, quit = false;

  void run();
  void accept_one();
  void read_some(Connection& connection, Way way);
  void spoil(std::vector<char>& bytes);
  void write_some(Connection& connection, Way way);
  void close_one(Connection& connection, bool by_reset);
  bool is_stopped(Way way) const { return stopped[way == Way::kUp ? 0 : 1]; }
  static Pipe& pipe_of(Connection& c, Way way) { return way == Way::kUp ? c.up : c.down; }
  static int source(const Connection& c, Way way) {
    return way == Way::kUp ? c.worker : c.coordinator;
  }
  static int sink(const Connection& c, Way way) {
    return way == Way::kUp ? c.coordinator : c.worker;
  }
};

void FaultyProxy::State::accept_one() {
  const int worker = accept4(listener, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (worker < 0) return;
  const int coordinator = open_socket();
  const sockaddr_in to = address_of(options.upstream, options.upstream_port);
  connect(coordinator, reinterpret_cast<const sockaddr*>(&to), sizeof to);  // goes on later
  at_once(worker);
  at_once(coordinator);
  connections.push_back({.worker = worker, .coordinator = coordinator});
  ++figures.connections;
}

void FaultyProxy::State::spoil(std::vector<char>& bytes) {
  if (flip_every == 0) return;
  for (std::size_t at = 0; at < bytes.size();) {
    if (until_flip == 0) until_flip = 1 + random.below(2 * flip_every);
    const std::size_t step = std::min<std::size_t>(until_flip, bytes.size() - at);
    at += step;
    until_flip -= step;
    if (until_flip != 0) return;
    bytes[at - 1] = static_cast<char>(bytes[at - 1] ^ 1 << random.below(8));
    ++figures.flips;
  }
}

void FaultyProxy::State::read_some(Connection& c, Way way) {
  Pipe& pipe = pipe_of(c, way);
  std::vector<char> bytes(kRead);
  const ssize_t got = recv(source(c, way), bytes.data(), bytes.size(), 0);
  if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (got <= 0) {
    pipe.ended = true;
    if (got < 0) c.dead = true;
    return;
  }
  bytes.resize(static_cast<std::size_t>(got));
  if (pipe.cut) return;
  if (way == Way::kUp && cut_at_least != 0 && bytes.size() >= cut_at_least) {
    bytes.resize(bytes.size() / 2);
    pipe.cut = true;
    cut_at_least = 0;
    ++figures.cuts;
  }
  spoil(bytes);
  const auto now = Clock::now();
  if (options.bytes_per_s > 0) {
    const std::chrono::duration<double> takes(static_cast<double>(bytes.size()) /
                                              options.bytes_per_s);
    pipe.free = std::max(pipe.free, now) + std::chrono::duration_cast<Clock::duration>(takes);
  }
  const auto delay = std::chrono::microseconds(static_cast<long>(options.delay_ms * 1e3));
  pipe.bytes += bytes.size();
  pipe.held.push_back({std::max(pipe.free, now) + delay, std::move(bytes)});
}

void FaultyProxy::State::write_some(Connection& c, Way way) {
  Pipe& pipe = pipe_of(c, way);
  const auto now = Clock::now();
  while (!pipe.held.empty() && pipe.held.front().due <= now && !is_stopped(way)) {
    Pipe::Piece& piece = pipe.held.front();
    const ssize_t sent = send(sink(c, way), piece.bytes.data() + piece.sent,
                              piece.bytes.size() - piece.sent, MSG_NOSIGNAL);
    if (sent < 0) {
      if (errno != EAGAIN && errno != ENOTCONN && errno != EINTR) c.dead = true;
      return;
    }
    piece.sent += static_cast<std::size_t>(sent);
    (way == Way::kUp ? figures.bytes_up : figures.bytes_down) += static_cast<std::uint64_t>(sent);
    if (piece.sent < piece.bytes.size()) return;
    pipe.bytes -= piece.bytes.size();
    pipe.held.pop_front();
  }
  // An end is no news that a cut or stopped way would carry.
  if (pipe.ended && pipe.held.empty() && !is_stopped(way)) c.dead = true;
}

void FaultyProxy::State::close_one(Connection& c, bool by_reset) {
  const linger hard{1, 0};
  for (const int fd : {c.worker, c.coordinator}) {
    if (by_reset) setsockopt(fd, SOL_SOCKET, SO_LINGER, &hard, sizeof hard);
    close(fd);
  }
  if (by_reset) ++figures.resets;
}

void FaultyProxy::State::run() {
  std::unique_lock lock(mutex);
  while (!quit) {
    std::vector<pollfd> polled{{wake, POLLIN, 0}, {listener, POLLIN, 0}};
    auto next = Clock::now() + std::chrono::milliseconds(500);
    for (Connection& c : connections) {
      for (const Way way : {Way::kUp, Way::kDown}) {
        Pipe& pipe = pipe_of(c, way);
        const bool reads = !pipe.ended && pipe.bytes < kMaxHeld && !is_stopped(way);
        const bool due = !pipe.held.empty() && !is_stopped(way);
        if (due) next = std::min(next, pipe.held.front().due);
        const bool writes = due && pipe.held.front().due <= Clock::now();
        polled.push_back({reads ? source(c, way) : -1, POLLIN, 0});
        polled.push_back({writes ? sink(c, way) : -1, POLLOUT, 0});
      }
    }
    const auto wait = std::chrono::duration_cast<std::chrono::microseconds>(next - Clock::now());
    // What is due already waits for its sink: that wakes us.
    const timespec time{0, std::max<long>(wait.count(), 200) * 1000};
    lock.unlock();
    ppoll(polled.data(), polled.size(), &time, nullptr);
    lock.lock();
    if ((polled[0].revents & POLLIN) != 0) {
      std::uint64_t count = 0;
      [[maybe_unused]] const ssize_t bytes = read(wake, &count, sizeof count);
    }
    std::size_t at = 2;
    for (Connection& c : connections)
      for (const Way way : {Way::kUp, Way::kDown}) {
        if (polled[at].revents != 0 && !c.dead) read_some(c, way);
        at += 2;
        if (!c.dead) write_some(c, way);
      }
    if (polled[1].revents != 0) accept_one();
    const bool reset_now = std::exchange(reset, false);
    std::erase_if(connections, [&](Connection& c) {
      if (c.dead || reset_now) close_one(c, reset_now);
      return c.dead || reset_now;
    });
  }
  for (Connection& c : connections) close_one(c, false);
}

FaultyProxy::FaultyProxy(const ProxyOptions& options) : state_(std::make_unique<State>()) {
  state_->options = options;
  state_->random = Random(options.seed);
  state_->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  state_->listener = open_socket();
  const int one = 1;
  setsockopt(state_->listener, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one);
  sockaddr_in address = address_of(options.listen, options.port);
  socklen_t size = sizeof address;
  PVS_CHECK_EQ(bind(state_->listener, reinterpret_cast<sockaddr*>(&address), size), 0);
  PVS_CHECK_EQ(listen(state_->listener, 1024), 0);
  getsockname(state_->listener, reinterpret_cast<sockaddr*>(&address), &size);
  state_->port = ntohs(address.sin_port);
  state_->thread = std::thread([state = state_.get()] { state->run(); });
}

FaultyProxy::~FaultyProxy() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->quit = true;
  }
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = write(state_->wake, &one, sizeof one);
  state_->thread.join();
  close(state_->listener);
  close(state_->wake);
}

int FaultyProxy::port() const { return state_->port; }
std::string FaultyProxy::endpoint() const {
  return "tcp://" + state_->options.listen + ":" + std::to_string(state_->port);
}

void FaultyProxy::flip_every(std::uint64_t bytes) {
  const std::lock_guard lock(state_->mutex);
  state_->flip_every = bytes;
  state_->until_flip = 0;
}

void FaultyProxy::stop(Way way, bool stopped) {
  const std::lock_guard lock(state_->mutex);
  state_->stopped[way == Way::kUp ? 0 : 1] = stopped;
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = write(state_->wake, &one, sizeof one);
}

void FaultyProxy::cut_next_upload(std::uint64_t at_least_bytes) {
  const std::lock_guard lock(state_->mutex);
  state_->cut_at_least = at_least_bytes;
}

void FaultyProxy::reset_all() {
  const std::lock_guard lock(state_->mutex);
  state_->reset = true;
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = write(state_->wake, &one, sizeof one);
}

ProxyFigures FaultyProxy::figures() const {
  const std::lock_guard lock(state_->mutex);
  return state_->figures;
}

}  // namespace pvsfarm
